//! Linker arguments of the images. Does nothing for the library and on the host.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") || env::var_os("CARGO_FEATURE_FIRMWARE").is_none() {
        return;
    }
    let mut arguments = vec!["--nmagic".to_owned(), "-Tlink.x".to_owned(), "-Tdefmt.x".to_owned()];
    // link.x includes memory.x from the search path.
    arguments.push(format!("-L{}", env::var("CARGO_MANIFEST_DIR").unwrap_or_default()));
    if env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv8m.main")) {
        arguments.push("--defsym=flash_origin=0x10000000".to_owned());
        arguments.push("--defsym=ram_origin=0x38000000".to_owned());
    }
    for argument in arguments {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
