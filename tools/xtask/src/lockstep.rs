//! The closed loop: the joint of `gmhm simulate --experiment joint`, driven by firmware in the emulator, against the same servo on the host.

use std::net::TcpListener;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::emulator;
use crate::machine;
use crate::program::{self, Profile};

/// The image at the other end of the line.
const IMAGE: &str = "joint";

/// How the gear is compensated: each way that remembers.
const COMPENSATIONS: [&str; 2] = ["reference", "measurement"];

/// What the command says where both agree.
const EQUAL: &str = "every bit agrees";

/// The published gear.
const MODEL: &str = "format = 1
[gear]
ratio = 100.0
torque_side = \"output\"
rated_deflection_rad = 1.168e-3
[elastic]
c1_nm_per_rad = 2.4737e4
c2_nm_per_rad3 = 1.0e9
c3_nm_per_rad5 = -1.1774e14
[memory]
law = \"masing\"
alpha = 2.6532e6
beta_per_s = 422.68
omega_per_s = 226.31
";

/// Drives the joint by the image on the Cortex-M4F.
pub fn run(shell: &Shell) -> Result<()> {
    let image = machine::M4F.build(shell, IMAGE)?;
    let folder = shell.create_temp_dir()?;
    let folder = folder.path();
    let gmhm = program::gmhm(shell, Profile::Dev)?;
    let (model, recording) = (folder.join("gear.toml"), folder.join("joint.csv"));
    shell.write_file(&model, MODEL)?;
    for compensation in COMPENSATIONS {
        println!("emulate: {IMAGE} on {} ({}), compensation {compensation}", machine::M4F.core, machine::M4F.board);
        let port = TcpListener::bind(("127.0.0.1", 0))?.local_addr()?.port();
        let _emulator = emulator::serve(&image, machine::M4F, port)?;
        let target = format!("tcp:127.0.0.1:{port}");
        let run = ["simulate", "--experiment", "joint", "--compensation", compensation];
        let output = cmd!(shell, "{gmhm} {run...} {model} --drive {target} -o {recording}")
            .quiet()
            .read()
            .context("the joint was not driven")?;
        let line = output.lines().find(|line| line.contains("position error")).unwrap_or_default();
        println!("emulate: {line}");
        ensure!(line.contains(EQUAL), "host and firmware differ in the closed loop");
    }
    Ok(())
}
