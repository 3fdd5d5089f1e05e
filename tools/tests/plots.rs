//! Plots: bounded in size, whole with odd data, each axis with its unit.

use gmhm_tools::recording::TorqueUnit;
use gmhm_tools::report::figures::{hysteresis_loop, residual};
use gmhm_tools::report::plot::{Bars, Role};

fn plot(rows: usize) -> String {
    let theta: Vec<f64> = (0..rows).map(|k| 1e-3 * (k as f64 * 0.01).sin()).collect();
    let torque: Vec<f64> = theta.iter().map(|x| 2e4 * x).collect();
    hysteresis_loop("loop", &theta, &torque, &[("model", Role::Model, &torque)], TorqueUnit::NewtonMetre).to_file()
}

fn assert_sound(svg: &str) {
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn the_size_is_bounded_whatever_the_length() {
    assert_sound(&plot(100));
    let svg = plot(1_000_000);
    assert_sound(&svg);
    assert!(svg.len() < 300_000, "{} bytes", svg.len());
}

#[test]
fn each_axis_has_its_unit_and_a_dark_page_its_colours() {
    for (svg, unit) in [
        (plot(100), "N·m"),
        (
            residual("left", &[0.0, 1e-3], &[0.0, 1.0], &[("model", Role::Model, &[0.1, 0.9])], TorqueUnit::Ampere)
                .to_file(),
            "in A",
        ),
    ] {
        assert!(svg.contains("in mrad") && svg.contains(unit), "{unit}");
        assert!(svg.contains("prefers-color-scheme:dark"));
    }
}

#[test]
fn odd_data_give_a_whole_picture() {
    for values in [vec![], vec![0.0], vec![1e-3; 5], vec![f64::NAN, 1.0, f64::INFINITY, -1.0]] {
        assert_sound(&hysteresis_loop("odd & <ends>", &values, &values, &[], TorqueUnit::NewtonMetre).to_file());
    }
    let bars = Bars {
        title: "bars".into(),
        x_label: "rms in N·m".into(),
        bars: vec![("a".into(), f64::NAN), ("b".into(), 1.0)],
    };
    assert_sound(&bars.draw().to_file());
    assert_sound(&Bars { bars: vec![], ..bars }.draw().to_file());
}
