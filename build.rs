//! Linker arguments of the images, and for the library whether a RISC-V core has a floating-point unit.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rustc-check-cfg=cfg(riscv_float_unit)");
    // Stable Rust names no feature `f` of these targets; their names do: riscv32imafc, riscv32gc.
    let target = env::var("TARGET").unwrap_or_default();
    let extensions = target.strip_prefix("riscv32").and_then(|rest| rest.split('-').next());
    if extensions.is_some_and(|extensions| extensions.contains(['f', 'g'])) {
        println!("cargo::rustc-cfg=riscv_float_unit");
    }
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") || env::var_os("CARGO_FEATURE_FIRMWARE").is_none() {
        return;
    }
    let mut arguments = vec!["--nmagic".to_owned(), "-Tlink.x".to_owned(), "-Tdefmt.x".to_owned()];
    // link.x includes memory.x from the search path.
    arguments.push(format!("-L{}", env::var("CARGO_MANIFEST_DIR").unwrap_or_default()));
    if target.starts_with("thumbv8m.main") {
        arguments.push("--defsym=flash_origin=0x10000000".to_owned());
        arguments.push("--defsym=ram_origin=0x38000000".to_owned());
    }
    for argument in arguments {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
