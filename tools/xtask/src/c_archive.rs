//! The library for C as other build systems take it: `lib/libgmhm.a`, `include/gmhm.h`, `lib/pkgconfig/gmhm.pc`, and `find_package(gmhm)` of CMake.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::program;
use crate::setup::COMPILER;

/// The target of the example on a microcontroller, and how the compiler is told.
const ARM: (&str, &str) = ("thumbv7em-none-eabihf", "-Os -mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16");

/// Writes the archive of a target into a folder; `None` is this computer.
pub fn write(shell: &Shell, target: Option<&str>, folder: &Path) -> Result<()> {
    let to: Vec<&str> = target.into_iter().flat_map(|target| ["--target", target]).collect();
    cmd!(shell, "cargo build --quiet --locked --package gmhm-c --profile firmware {to...}").quiet().run()?;
    let built = shell.current_dir().join("target").join(target.unwrap_or_default()).join("firmware/libgmhm_c.a");
    for part in ["lib/pkgconfig", "lib/cmake/gmhm", "include"] {
        shell.create_dir(folder.join(part))?;
    }
    shell.copy_file(built, folder.join("lib/libgmhm.a"))?;
    shell.copy_file("c/include/gmhm.h", folder.join("include/gmhm.h"))?;
    let version = version(shell)?;
    // The standard library of Rust needs them on a computer; a microcontroller's has none.
    let (system, cmake) = if target.is_none() { ("-lm -lpthread -ldl", "m;pthread;dl") } else { ("", "") };
    for (template, file) in [
        ("gmhm.pc", "lib/pkgconfig/gmhm.pc"),
        ("gmhmConfig.cmake", "lib/cmake/gmhm/gmhmConfig.cmake"),
        ("gmhmConfigVersion.cmake", "lib/cmake/gmhm/gmhmConfigVersion.cmake"),
    ] {
        let text = shell.read_file(format!("c/package/{template}.in"))?;
        let text = text
            .replace("@VERSION@", &version)
            .replace("@SYSTEM_LIBRARIES@", system)
            .replace("@CMAKE_LIBRARIES@", cmake);
        shell.write_file(folder.join(file), text)?;
    }
    Ok(())
}

/// The version of the workspace, which the header repeats.
fn version(shell: &Shell) -> Result<String> {
    let text = shell.read_file("Cargo.toml")?;
    let (_, package) = text.split_once("[workspace.package]").context("no [workspace.package] in Cargo.toml")?;
    let line = package.lines().find_map(|line| line.strip_prefix("version = \"")).context("no version")?;
    Ok(line.trim_end_matches('"').to_owned())
}

/// Builds the example against the archive by make, and by CMake where that is installed; runs it on this computer and links it for a microcontroller.
pub fn check(shell: &Shell) -> Result<()> {
    let folder = shell.create_temp_dir()?;
    let [host, arm, work] = ["host", "arm", "example"].map(|name| folder.path().join(name));
    write(shell, None, &host)?;
    write(shell, Some(ARM.0), &arm)?;
    shell.create_dir(&work)?;
    for file in ["main.c", "Makefile", "CMakeLists.txt"] {
        shell.copy_file(format!("c/example/{file}"), work.join(file))?;
    }
    let params = work.join("params.h");
    let gmhm = program::gmhm(shell, false)?;
    cmd!(shell, "{gmhm} --quiet pack examples/bench/true_gear.toml -o {params}").quiet().run()?;
    let script = shell.current_dir().join("c/arm");
    let _inside = shell.push_dir(&work);
    cmd!(shell, "make --silent GMHM={host} CFLAGS=-Werror")
        .quiet()
        .run()
        .context("the example does not build by make")?;
    let printed = cmd!(shell, "./example").quiet().read()?;
    ensure!(printed.lines().count() == 4 && printed.contains("gain 1.00"), "the example prints otherwise:\n{printed}");
    let cmake = cmd!(shell, "cmake --version").quiet().ignore_stdout().ignore_stderr().run().is_ok();
    if cmake {
        cmd!(shell, "cmake -S . -B build -DCMAKE_PREFIX_PATH={host}").quiet().ignore_stdout().run()?;
        cmd!(shell, "cmake --build build")
            .quiet()
            .ignore_stdout()
            .run()
            .context("the example does not build by CMake")?;
        ensure!(
            cmd!(shell, "build/example").quiet().read()? == printed,
            "built by CMake, the example prints otherwise"
        );
    }
    let start = script.join("start.c");
    let flags = format!(
        "{} -ffunction-sections --specs=nano.specs --specs=rdimon.specs -nostartfiles -T {} {}",
        ARM.1,
        script.join("program.ld").display(),
        start.display()
    );
    cmd!(shell, "make --silent clean").quiet().run()?;
    cmd!(shell, "make --silent GMHM={arm} CC={COMPILER} CFLAGS={flags} LDFLAGS=-Wl,--gc-sections LDLIBS=-lm")
        .quiet()
        .run()
        .context("the example does not build for a microcontroller")?;
    let by = if cmake { "make and CMake" } else { "make (CMake is not installed)" };
    println!("c: the example builds against the archive by {by}, and for {}", ARM.0);
    Ok(())
}
