//! The library for C as other build systems take it: `lib/libgmhm.a`, `include/gmhm.h`, `lib/pkgconfig/gmhm.pc`, and `find_package(gmhm)` of CMake.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::emulator;
use crate::machine::M4F;
use crate::program::{self, Profile};
use crate::python::environment;
use crate::setup::{COMPILER, M4F_OPTIONS};

/// Functions that every C library has: on a microcontroller the archive takes the program's own.
const OF_THE_C_LIBRARY: [&str; 6] = ["memcpy", "memmove", "memset", "memcmp", "bcmp", "strlen"];

/// From the package index.
const CMAKE: &str = "cmake==4.4.4";

/// Writes the archive of a target into a folder; `None` is this computer.
pub fn write(shell: &Shell, target: Option<&str>, folder: &Path) -> Result<()> {
    let to: Vec<&str> = target.into_iter().flat_map(|target| ["--target", target]).collect();
    cmd!(shell, "cargo build --quiet --locked --package gmhm-c --profile firmware {to...}").quiet().run()?;
    let built = program::target(shell).join(target.unwrap_or_default()).join("firmware/libgmhm_c.a");
    for part in ["lib/pkgconfig", "lib/cmake/gmhm", "include"] {
        shell.create_dir(folder.join(part))?;
    }
    let library = folder.join("lib/libgmhm.a");
    shell.copy_file(built, &library)?;
    if target.is_some() {
        leave_to_the_c_library(shell, &library)?;
    }
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

/// Takes the members out of an archive that define nothing but functions of the C library.
fn leave_to_the_c_library(shell: &Shell, library: &Path) -> Result<()> {
    let root = cmd!(shell, "rustc --print sysroot").quiet().read()?;
    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let tool = |name: &str| format!("{root}/lib/rustlib/{host}/bin/{name}");
    let (names, archiver) = (tool("llvm-nm"), tool("llvm-ar"));
    let text = cmd!(shell, "{names} --print-file-name --defined-only --extern-only {library}")
        .quiet()
        .ignore_stderr()
        .read()
        .with_context(|| format!("cannot run {names}: run `cargo xtask setup`, which installs it"))?;
    // ARCHIVE:MEMBER: ADDRESS KIND NAME
    let of_c = |name: &str| OF_THE_C_LIBRARY.contains(&name) || name.starts_with("__aeabi_mem");
    let symbol = |line: &str| {
        let (location, rest) = line.rsplit_once(": ")?;
        let member = location.rsplit_once(':').map_or(location, |(_, member)| member).to_owned();
        Some((member, of_c(rest.split(' ').next_back()?)))
    };
    let mut members = std::collections::BTreeMap::new();
    for (member, is_of_c) in text.lines().filter_map(symbol) {
        *members.entry(member).or_insert(true) &= is_of_c;
    }
    let members: Vec<String> = members.into_iter().filter(|(_, of_c)| *of_c).map(|(member, _)| member).collect();
    ensure!(
        !members.is_empty(),
        "the library defines no function of the C library: nothing is to be taken out any more"
    );
    cmd!(shell, "{archiver} d {library} {members...}").quiet().run()?;
    Ok(())
}

/// The version of the workspace, which the header repeats.
fn version(shell: &Shell) -> Result<String> {
    let text = shell.read_file("Cargo.toml")?;
    let (_, package) = text.split_once("[workspace.package]").context("no [workspace.package] in Cargo.toml")?;
    let line = package.lines().find_map(|line| line.strip_prefix("version = \"")).context("no version")?;
    Ok(line.trim_end_matches('"').to_owned())
}

/// Builds the example against the archive by make and by CMake, for this computer and for a microcontroller, where the emulator runs it.
pub fn check(shell: &Shell, arm: &Path) -> Result<()> {
    let folder = shell.create_temp_dir()?;
    let [host, work] = ["host", "example"].map(|name| folder.path().join(name));
    write(shell, None, &host)?;
    shell.create_dir(&work)?;
    for file in ["main.c", "Makefile", "CMakeLists.txt", "cortex-m4f.cmake"] {
        shell.copy_file(format!("c/example/{file}"), work.join(file))?;
    }
    let params = work.join("params.h");
    let gmhm = program::gmhm(shell, Profile::Dev)?;
    cmd!(shell, "{gmhm} --quiet pack examples/bench/true_gear.toml -o {params}").quiet().run()?;
    let environment = environment(shell, "cmake", &[CMAKE], "cmake")?;
    let cmake = environment.map(|python| python.with_file_name("cmake"));
    let board = shell.current_dir().join("c/arm");
    let _inside = shell.push_dir(&work);
    let fails = |by: &'static str| move || format!("the example does not build by {by}");
    cmd!(shell, "make --silent GMHM={host} CFLAGS=-Werror").quiet().run().with_context(fails("make"))?;
    let printed = cmd!(shell, "./example").quiet().read()?;
    ensure!(printed.lines().count() == 4 && printed.contains("gain 1.00"), "the example prints otherwise:\n{printed}");
    let (start, script) = (board.join("start.c"), board.join("program.ld"));
    let link = format!(
        "-Wl,--gc-sections,-z,noexecstack --specs=nano.specs --specs=rdimon.specs -u _printf_float -nostartfiles -T {} {}",
        script.display(),
        start.display()
    );
    let flags = format!("-Os {} -ffunction-sections", M4F_OPTIONS.join(" "));
    cmd!(shell, "make --silent clean").quiet().run()?;
    cmd!(shell, "make --silent GMHM={arm} CC={COMPILER} CFLAGS={flags} LDFLAGS={link} LDLIBS=-lm")
        .quiet()
        .run()
        .with_context(fails("make for a microcontroller"))?;
    same_in_the_emulator(&work.join("example"), &work, &printed)?;
    let Some(cmake) = cmake else {
        println!("c: the example builds against the archive by make, for this computer and for {}", M4F.target);
        return Ok(());
    };
    cmd!(shell, "{cmake} -S . -B build -DCMAKE_PREFIX_PATH={host}")
        .quiet()
        .ignore_stdout()
        .run()
        .with_context(fails("CMake"))?;
    cmd!(shell, "{cmake} --build build").quiet().ignore_stdout().run().with_context(fails("CMake"))?;
    ensure!(cmd!(shell, "build/example").quiet().read()? == printed, "built by CMake, the example prints otherwise");
    let toolchain = "-DCMAKE_TOOLCHAIN_FILE=cortex-m4f.cmake";
    cmd!(shell, "{cmake} -S . -B build-arm {toolchain} -DCMAKE_PREFIX_PATH={arm} -DCMAKE_EXE_LINKER_FLAGS={link}")
        .quiet()
        .ignore_stdout()
        .run()
        .with_context(fails("CMake for a microcontroller"))?;
    cmd!(shell, "{cmake} --build build-arm")
        .quiet()
        .ignore_stdout()
        .run()
        .with_context(fails("CMake for a microcontroller"))?;
    same_in_the_emulator(&work.join("build-arm/example"), &work, &printed)?;
    println!(
        "c: the example builds against the archive by make and by CMake, for this computer and for {}",
        M4F.target
    );
    Ok(())
}

/// Holds what an image prints against what the host has printed.
fn same_in_the_emulator(image: &Path, folder: &Path, expected: &str) -> Result<()> {
    let [printed, _] = emulator::output(image, M4F, folder, &[])?;
    ensure!(printed.trim_end() == expected, "the example prints otherwise on the {}:\n{printed}", M4F.core);
    Ok(())
}
