//! `gmhm flash` against a drive behind a TCP port: the core's own port over a RAM-backed store.

use std::net::TcpListener;

use crate::common::{PUBLISHED, WorkDir};
use crate::served::{Accident, Joint, ON, blank, serve};

/// A gear with a term.
fn model() -> String {
    PUBLISHED.to_owned() + "[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.4\nsmoothing_rad_per_s = 0.01\n"
}

fn packed(dir: &WorkDir) {
    dir.write("gear.toml", model());
    dir.succeed("pack gear.toml -o params.bin");
}

#[test]
fn a_block_is_stored_and_read_back() {
    let dir = WorkDir::new();
    packed(&dir);
    let served = serve(Joint { compensation: ON, ..Joint::default() }, blank(), 2, None);
    let to = format!("flash params.bin --to tcp:{} --read-back back.bin", served.address);
    let first = dir.succeed(&to).stdout;
    assert!(first.contains("for gear \"published\", sequence 1"), "{first}");
    assert!(dir.succeed(&to).stdout.contains("sequence 2"));
    let (joint, _) = served.end();
    let parameters = joint.parameters.expect("parameters in force");
    assert_eq!((parameters.header.sequence, parameters.terms.terms().len()), (2, 1));
    assert!(joint.compensation.on, "the compensation is on again");

    // What was read back is what was packed, but for the sequence number and with it the CRC-32.
    let lines = |file: &str| -> Vec<String> {
        let text = dir.succeed(&format!("inspect {file}")).stdout;
        text.lines().filter(|line| !line.contains("sequence") && !line.contains("CRC-32")).map(str::to_owned).collect()
    };
    assert_eq!(lines("back.bin"), lines("params.bin"));
    assert!(lines("params.bin").len() > 10);
    let [packed, back] = ["params.bin", "back.bin"].map(|file| std::fs::read(dir.path(file)).expect("a block"));
    let differing: Vec<_> = packed.iter().zip(&back).enumerate().filter(|(_, (a, b))| a != b).map(|(k, _)| k).collect();
    assert_eq!(packed.len(), back.len());
    assert!(differing.iter().all(|k| (12..16).contains(k) || *k >= packed.len() - 4), "{differing:?}");
}

#[test]
fn a_broken_line_is_started_over() {
    let dir = WorkDir::new();
    packed(&dir);
    for accident in [
        Accident::BreaksAfter(10),
        Accident::BreaksAfter(150),
        Accident::BreaksAfter(260),
        Accident::FlipsByte(100),
        Accident::SwallowsAnswer(2),
        // The answer to the commit: the block is stored, and the second attempt finds it there.
        Accident::SwallowsAnswer(7),
    ] {
        let served = serve(Joint::default(), blank(), 2, Some(accident));
        let told = dir.succeed(&format!("flash params.bin --to tcp:{}", served.address)).stdout;
        assert!(told.contains("sequence 1"), "{accident:?}: {told}");
        let (joint, _) = served.end();
        assert_eq!(joint.parameters.map(|parameters| parameters.header.sequence), Some(1), "{accident:?}");
    }
}

#[test]
fn refusals_are_told_and_leave_the_drive_as_it_was() {
    let dir = WorkDir::new();
    packed(&dir);
    let served = serve(Joint::default(), blank(), 1, None);
    dir.succeed(&format!("flash params.bin --to tcp:{}", served.address));
    let (joint, memory) = served.end();

    dir.succeed("pack gear.toml --gear other -o other.bin");
    dir.succeed("pack gear.toml --stack-depth 32 -o deep.bin");
    for (joint, block, told) in [
        (Joint { enabled: true, ..joint.clone() }, "params.bin", "the drive is enabled"),
        (joint.clone(), "other.bin", "for gear \"other\", but the drive has gear \"published\""),
        (joint.clone(), "deep.bin", "32 turning points, but the drive has room for 16"),
    ] {
        let served = serve(joint, memory.clone(), 1, None);
        dir.refuse(&format!("flash {block} --to tcp:{}", served.address), &[told, "help: "]);
        let (joint, after) = served.end();
        assert_eq!(joint.parameters.map(|parameters| parameters.header.sequence), Some(1));
        assert_eq!(after, memory);
    }
}

#[test]
fn a_target_that_is_not_there_is_named() {
    let dir = WorkDir::new();
    packed(&dir);
    let free = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let unreachable = format!("tcp:{free}: cannot be opened");
    dir.refuse(&format!("flash params.bin --to tcp:{free}"), &[&unreachable, "help: "]);
    dir.refuse("flash params.bin --to serial:/no/such/port", &["serial:/no/such/port: cannot be opened", "help: "]);
    dir.write("no.bin", "no block");
    dir.refuse("flash no.bin --to tcp:localhost:1", &["no.bin"]);
    assert_eq!(dir.gmhm("flash params.bin --to nowhere").status, Some(2));
}
