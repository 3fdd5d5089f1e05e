//! Terms in `gmhm predict`, against tables that tools/tests/reference/terms.py computes by an implementation of its own.

use crate::common::{PUBLISHED, WorkDir};
use gmhm_tools::model::{Model, parse};
use gmhm_tools::physics::{PredictError, predict};
use gmhm_tools::recording::Recording;

type Row = [f64; 8];

const TIME: Row = [0.0, 0.1, 0.25, 0.35, 0.5, 0.6, 0.8, 0.9];
const DEFLECTION_MRAD: Row = [0.1, 0.6, 1.1, 0.7, -0.02, 0.03, -0.9, 0.2];
const OUTPUT: Row = [0.3, 0.5, 0.9, 1.0, 0.8, 0.75, 0.2, -0.4];
const VELOCITY: Row = [2.0, 2.5, 1.5, -0.02, -1.0, -2.0, 0.05, 0.0];
const TEMPERATURE: Row = [22.0, 23.0, 25.0, 26.0, 28.0, 29.0, 31.0, 35.0];
const SIMULATED_TORQUE: Row = [2.0, 12.0, 25.0, 11.0, -4.0, -2.5, -19.0, 7.0];
const BASE: Row = [
    1.9886352060e+00,
    1.4031535356e+01,
    2.7299160067e+01,
    1.3924954946e+01,
    -2.6915082121e+00,
    -1.4428732101e+00,
    -2.0875639770e+01,
    6.2831916774e+00,
];

/// Kind, keys, and the column that they give alone.
#[rustfmt::skip]
const KINDS: &[(&str, &str, Row)] = &[
    ("kinematic_error", r#"orders = [2, 4.5]
cos_rad = [5e-5, 1e-5]
sin_rad = [-2e-5, 3e-5]"#, [9.8987237902e-01, -9.1718491434e-01, 8.6370169794e-01, -3.6823220788e-01, 6.5052938857e-01, -4.7484160333e-01, 5.2642152272e-01, 3.7293867582e-01]),
    ("torque_ripple", r#"orders = [1, 2.02]
cos_nm = [0.5, 0.1]
sin_nm = [0.2, -0.3]"#, [6.5460902094e-02, 3.6478751235e-01, 5.1033504968e-02, 1.4151652200e-01, 1.9851046430e-02, 2.6485175038e-01, 1.6259324036e-01, -6.5618298720e-01]),
    ("kinematic_error", r#"angle = "output"
orders = [2, 101.5]
cos_rad = [5e-5, 1e-5]
sin_rad = [-2e-5, 3e-5]"#, [-2.1893164143e-01, -7.7363686288e-01, 1.8510783137e+00, -1.5529318811e-01, 2.8815943151e-01, -6.4659760364e-01, -1.7913480555e+00, -4.1082174247e-01]),
    ("torque_ripple", r#"angle = "output"
orders = [2, 101.5]
cos_nm = [0.5, 0.1]
sin_nm = [0.2, -0.3]"#, [8.2923464415e-01, 3.8720088092e-01, 5.6547418070e-02, -2.1690637072e-01, 4.1285784534e-01, 1.1026043896e-01, 2.5259043522e-01, 1.7928117071e-01]),
    ("encoder_eccentricity", r#"cos_rad = 4e-5
sin_rad = -6e-5"#, [-4.0813335433e-01, -1.3615760356e-01, 7.2827291696e-01, 5.6585546296e-01, 1.3323452450e-01, 4.5251932656e-02, -7.5727545597e-01, -1.2001684261e+00]),
    ("gravity_load", r#"cos_nm = 3.0
sin_nm = -1.5"#, [2.4227291574e+00, 1.9136093778e+00, 6.8983954037e-01, 3.5870044039e-01, 1.0140859917e+00, 1.1726084666e+00, 2.6421957373e+00, 3.3473104955e+00]),
    ("coulomb_friction", r#"torque_nm = 0.7
smoothing_rad_per_s = 0.05"#, [-7.0000000000e-01, -7.0000000000e-01, -7.0000000000e-01, 2.6596427358e-01, 7.0000000000e-01, 7.0000000000e-01, -5.3311590917e-01, -0.0000000000e+00]),
    ("coulomb_friction", r#"torque_nm = 0.7"#, [-7.0000000000e-01, -7.0000000000e-01, -7.0000000000e-01, 7.0000000000e-01, 7.0000000000e-01, 7.0000000000e-01, -7.0000000000e-01, -0.0000000000e+00]),
    ("viscous_friction", r#"damping_nms_per_rad = 1.25"#, [-2.5000000000e+00, -3.1250000000e+00, -1.8750000000e+00, 2.5000000000e-02, 1.2500000000e+00, 2.5000000000e+00, -6.2500000000e-02, -0.0000000000e+00]),
    ("viscous_friction", r#"damping_nms_per_rad = 1.25
exponent = 0.7"#, [-2.0306309909e+00, -2.3739306029e+00, -1.6602515499e+00, 8.0840875822e-02, 1.2500000000e+00, 2.0306309909e+00, -1.5352850326e-01, -0.0000000000e+00]),
    ("stribeck_friction", r#"coulomb_nm = 0.5
static_nm = 0.9
stribeck_velocity_rad_per_s = 0.8
exponent = 1.5
damping_nms_per_rad = 0.3
smoothing_rad_per_s = 0.02"#, [-1.1076799841e+00, -1.2515955090e+00, -9.8069239975e-01, 6.9023293112e-01, 8.9888148988e-01, 1.1076799841e+00, -8.9683445357e-01, -0.0000000000e+00]),
    ("load_dependent_friction", r#"mu = 0.03
smoothing_rad_per_s = 0.1"#, [-5.9659056179e-02, -4.2094606068e-01, -8.1897480200e-01, 8.2453273245e-02, 8.0745246031e-02, 4.3286196304e-02, -2.8940973919e-01, -0.0000000000e+00]),
    ("position_dependent_friction", r#"angle = "output"
orders = [3]
cos_nm = [0.4]
sin_nm = [0.1]
smoothing_rad_per_s = 0.1"#, [-3.2697667827e-01, -1.2804437933e-01, 3.1889086878e-01, -7.5374673737e-02, -2.2741116722e-01, -1.7346212940e-01, -1.7865379673e-01, -0.0000000000e+00]),
    ("position_dependent_friction", r#"angle = "motor"
orders = [2]
cos_nm = [0.4]
sin_nm = [0.1]
smoothing_rad_per_s = 0"#, [4.1083034434e-01, -3.2674490016e-01, 2.5492461978e-01, 1.6203653477e-01, -3.6756492265e-01, 2.1034417291e-01, 1.2385855366e-01, -0.0000000000e+00]),
    ("viscous_damping", r#"damping_nms_per_rad = 150"#, [7.5000000000e-01, 6.5000000000e-01, -1.6000000000e-01, -6.4800000000e-01, -2.4300000000e-01, -1.8250000000e-01, 8.6750000000e-01, 1.6500000000e+00]),
    ("inertia", r#"inertia_kgm2 = 0.2"#, [-1.0000000000e+00, -6.6666666667e-02, 2.3573333333e+00, 2.3466666667e+00, 1.7226666667e+00, 6.5000000000e-01, -6.1666666667e-01, 1.0000000000e-01]),
    ("soft_windup", r#"shape = "tanh"
stiffness_drop_nm_per_rad = 5000
width_rad = 3e-4"#, [-4.8226910630e-01, -1.4460413701e+00, -1.4980411040e+00, -1.4720521220e+00, 9.9852114753e-02, -1.4950199194e-01, 1.4925821305e+00, -8.7417441802e-01]),
    ("soft_windup", r#"shape = "rational"
stiffness_drop_nm_per_rad = 5000
width_rad = 3e-4"#, [-4.5000000000e-01, -6.0000000000e-01, -3.8076923077e-01, -5.4310344828e-01, 9.9557522124e-02, -1.4851485149e-01, 4.5000000000e-01, -6.9230769231e-01]),
    ("soft_windup", r#"shape = "gaussian"
stiffness_drop_nm_per_rad = 5000
width_rad = 3e-4"#, [-4.7297973445e-01, -4.0600584971e-01, -6.6212299716e-03, -2.3004985016e-01, 9.9778024509e-02, -1.4925187188e-01, 4.9990484422e-02, -8.0073740292e-01]),
    ("soft_windup", r#"shape = "piecewise"
k1_nm_per_rad = 16000
k2_nm_per_rad = 20000
k3_nm_per_rad = 23000
t1_nm = 4
t2_nm = 12"#, [-7.0000000000e-01, -2.8000000000e+00, -2.9500000000e+00, -2.9500000000e+00, 1.4000000000e-01, -2.1000000000e-01, 2.9500000000e+00, -1.4000000000e+00]),
    ("stiffness_asymmetry", r#"shape = "square"
stiffness_nm_per_rad2 = 4e5"#, [4.0000000000e-03, 1.4400000000e-01, 4.8400000000e-01, 1.9600000000e-01, 1.6000000000e-04, 3.6000000000e-04, 3.2400000000e-01, 1.6000000000e-02]),
    ("stiffness_asymmetry", r#"shape = "abs"
stiffness_nm_per_rad = -300"#, [-3.0000000000e-02, -1.8000000000e-01, -3.3000000000e-01, -2.1000000000e-01, -6.0000000000e-03, -9.0000000000e-03, -2.7000000000e-01, -6.0000000000e-02]),
    ("backlash", r#"shape = "clearance"
half_gap_rad = 4e-5"#, [-7.9652578946e-01, -9.1330655275e-01, -1.4648897605e+00, -9.6271184295e-01, 8.2587045297e-01, 8.2670720961e-01, 8.2528394331e-01, -1.1273034002e+00]),
    ("backlash", r#"shape = "play"
half_gap_rad = 4e-5"#, [0.0000000000e+00, -9.5051942814e-01, -1.3231945811e+00, 1.4167901362e+00, 9.6756563236e-01, -2.8106936963e-01, 9.6697912270e-01, -9.8560822078e-01]),
    ("nonlocal_memory", r#"radius_rad = [2e-4, 6e-4]
torque_nm = [0.5, 0.8]"#, [0.0000000000e+00, 1.1666666667e+00, 1.3000000000e+00, -2.3333333333e-01, -1.1933333333e+00, -1.0016666667e+00, -1.3000000000e+00, 1.1666666667e+00]),
    ("creep", r#"tau_s = [0.4, 20]
stiffness_nm_per_rad = [500, 200]"#, [0.0000000000e+00, 3.2094963307e-01, 5.5913268666e-01, 2.2163961798e-01, -2.5536376532e-01, -1.7251254240e-01, -6.6192137163e-01, 1.4705990731e-01]),
    ("time_skew", r#"delay_s = 0.03"#, [0.0000000000e+00, -3.6128700450e+00, -2.6535249421e+00, 4.0122615363e+00, 3.3232926315e+00, -3.7459050060e-01, 2.9149149839e+00, -8.1476494341e+00]),
    ("time_skew", r#"delay_s = -0.12"#, [1.3811916778e+01, 1.0614099769e+01, -1.5589733542e+01, -1.3293170526e+01, -6.9464165396e-01, -1.1659659936e+01, 2.7158831447e+01, 0.0000000000e+00]),
    ("thermal_stiffness", r#"per_k = 3e-4
reference_c = 22"#, [-0.0000000000e+00, -4.4526600000e-03, -2.4489630000e-02, -2.0779080000e-02, 8.9053200000e-04, -1.5584310000e-03, 6.0110910000e-02, -1.9294860000e-02]),
    ("thermal_zero_drift", r#"nm_per_k = 0.05
reference_c = 25"#, [-1.5000000000e-01, -1.0000000000e-01, 0.0000000000e+00, 5.0000000000e-02, 1.5000000000e-01, 2.0000000000e-01, 3.0000000000e-01, 5.0000000000e-01]),
    ("thermal_friction", r#"per_k = 0.02
reference_c = 22"#, [0.0000000000e+00, 0.0000000000e+00, 0.0000000000e+00, 0.0000000000e+00, 0.0000000000e+00, 0.0000000000e+00, 0.0000000000e+00, 0.0000000000e+00]),
    ("sensor_drift", r#"nm_per_s = 0.4"#, [0.0000000000e+00, 4.0000000000e-02, 1.0000000000e-01, 1.4000000000e-01, 2.0000000000e-01, 2.4000000000e-01, 3.2000000000e-01, 3.6000000000e-01]),
    ("wear", r#"shape = "step"
stiffness_drop_nm_per_rad = 900
start_s = 0.35"#, [-0.0000000000e+00, -0.0000000000e+00, -0.0000000000e+00, -6.3000000000e-01, 1.8000000000e-02, -2.7000000000e-02, 8.1000000000e-01, -1.8000000000e-01]),
    ("wear", r#"shape = "ramp"
stiffness_drop_nm_per_rad = 900
start_s = 0.2
duration_s = 0.4"#, [-0.0000000000e+00, -0.0000000000e+00, -1.2375000000e-01, -2.3625000000e-01, 1.3500000000e-02, -2.7000000000e-02, 8.1000000000e-01, -1.8000000000e-01]),
    ("unknown", r#"coordinate = "output_velocity"
knots = [-1.5, 0, 2]
values_nm = [1, -1, 0.5]"#, [5.0000000000e-01, 5.0000000000e-01, 1.2500000000e-01, -9.7333333333e-01, 3.3333333333e-01, 1.0000000000e+00, -9.6250000000e-01, -1.0000000000e+00]),
    ("unknown", r#"coordinate = "motor_angle"
knots = [0, 2, 4]
values_nm = [1, -1, 0.5]"#, [6.9211291535e-01, 9.5500092419e-01, -8.9094572539e-01, 8.9905223342e-01, 6.3134639400e-01, 9.1344905626e-01, -6.0444078461e-02, 5.0050305822e-01]),
    ("unknown", r#"coordinate = "torque"
knots = [-10, 10]
values_nm = [-1, 1]"#, [1.9886352060e-01, 1.0000000000e+00, 1.0000000000e+00, 1.0000000000e+00, -2.6915082121e-01, -1.4428732101e-01, -1.0000000000e+00, 6.2831916774e-01]),
    ("torque_scale", r#"gain_error = -0.04"#, [-8.0000000000e-02, -4.8000000000e-01, -1.0000000000e+00, -4.4000000000e-01, 1.6000000000e-01, 1.0000000000e-01, 7.6000000000e-01, -2.8000000000e-01]),
    ("load_dependent_memory", r#"radius_rad = [2e-4, 6e-4]
torque_nm = [0.5, 0.8]
load_linear = 0.9
load_quadratic = 0.4"#, [0.0000000000e+00, 3.1253049353e-01, 1.1730981422e+00, -8.9379495840e-02, -0.0000000000e+00, -0.0000000000e+00, -8.2028804654e-01, 0.0000000000e+00]),
    ("load_dependent_memory", r#"radius_rad = [3e-4]
torque_nm = [0.5]
load_quadratic = 0.6"#, [0.0000000000e+00, 2.7916588478e-01, 4.6608533496e-01, -1.0258452180e-01, -2.0008796209e-01, -1.6683159559e-01, -3.7812324076e-01, 2.0879620942e-01]),
    ("presliding_friction", r#"torque_nm = 0.7
radius_rad = 0.15"#, [-0.0000000000e+00, -5.1548200332e-01, -6.8717905278e-01, -6.9341750621e-01, 3.3269913316e-01, 4.3681742851e-01, 6.9327264996e-01, 6.9987678429e-01]),
    ("encoder_skew", r#"delay_s = 4e-5"#, [-1.5914438883e+00, -2.2691194582e+00, -2.2251943030e+00, 1.6038630491e-01, 7.6200027742e-01, 1.7563737288e+00, -3.4101057950e-01, -2.8392708293e-01]),
    ("ripple_resonance", r#"orders = [1, 2]
cos_nm = [0.5, 0.1]
sin_nm = [0.2, -0.3]
frequency_hz = 40
damping_ratio = 0.1"#, [-8.4024418603e-01, 3.5493871560e-01, -3.2674534271e-01, 6.5824842265e-01, -4.1516228494e-01, -7.2682946626e-02, -1.4035178979e-01, 1.2061502261e-01]),
    ("ripple_resonance", r#"angle = "output"
orders = [2, 30]
cos_nm = [0.5, 0.1]
sin_nm = [0.2, -0.3]
frequency_hz = 8
damping_ratio = 0.1"#, [6.8151759422e-01, 6.2715481800e-01, -7.7022645009e-01, 2.8570317249e-01, 6.4300593731e-01, 4.3562132163e-01, 7.1997106555e-01, 1.2829565697e-01]),
];

/// Coulomb friction, friction of the load, damping, thermal friction, eccentricity, skew, Coulomb friction again.
#[rustfmt::skip]
const SEVERAL: [Row; 7] = [
    [-7.0000000000e-01, -7.0000000000e-01, -7.0000000000e-01, 2.6596427358e-01, 7.0000000000e-01, 7.0000000000e-01, -5.3311590917e-01, -0.0000000000e+00],
    [-5.9659056179e-02, -4.2094606068e-01, -8.1897480200e-01, 8.2453273245e-02, 8.0745246031e-02, 4.3286196304e-02, -2.8940973919e-01, -0.0000000000e+00],
    [7.5000000000e-01, 6.5000000000e-01, -1.6000000000e-01, -6.4800000000e-01, -2.4300000000e-01, -1.8250000000e-01, 8.6750000000e-01, 1.6500000000e+00],
    [-0.0000000000e+00, 2.2196219153e-02, 8.8458206068e-02, -2.6787613983e-02, -8.8286331456e-02, -9.7104220289e-02, 1.3549447616e-01, 0.0000000000e+00],
    [-3.7467263820e-01, -1.0803453478e-01, 7.2515311915e-01, 5.6953406345e-01, 1.2102015032e-01, 3.0801083684e-02, -8.0869789537e-01, -1.2495559817e+00],
    [0.0000000000e+00, -3.5611342404e+00, -2.5918091220e+00, 3.6797032944e+00, 3.2578296178e+00, -3.5179169904e-01, 3.0833218030e+00, -8.4562513599e+00],
    [-2.0000000000e-01, -1.9722781426e-01, -1.8989027231e-01, 7.2730416479e-02, 1.7883192373e-01, 1.7492537916e-01, -1.1591518888e-01, -5.0116212685e-02],
];

/// Gravity, friction of the load, inertia, ripple of a joint log.
#[rustfmt::skip]
const JOINT: [Row; 4] = [
    [2.4227291574e+00, 1.9136093778e+00, 6.8983954037e-01, 3.5870044039e-01, 1.0140859917e+00, 1.1726084666e+00, 2.6421957373e+00, 3.3473104955e+00],
    [7.2681874722e-02, 5.7408281333e-02, 2.0695186211e-02, -2.1239584286e-03, -3.0422579625e-02, -3.5178253998e-02, 3.6630119492e-02, 0.0000000000e+00],
    [1.0300000000e+00, 6.8666666667e-02, -2.3280037058e+00, -2.3563139724e+00, -1.7135015072e+00, -6.3050000000e-01, 6.2521583408e-01, -1.0000000000e-01],
    [-3.1620495623e-01, 2.0805909758e-01, -2.5965328429e-01, 5.8826572781e-02, -2.7074626800e-01, 1.3828759898e-01, -1.2557010245e-01, 6.6272692241e-02],
];

/// Gravity, friction of the load, scale and skew over a simulation.
#[rustfmt::skip]
const SIMULATED: [Row; 4] = [
    [7.9382121197e-01, 7.5000860337e-01, 5.7562066558e-01, 5.1638894318e-01, 6.2910097657e-01, 6.5351497110e-01, 8.0392019535e-01, 6.9790696097e-01],
    [-6.0000000000e-02, -3.6000000000e-01, -7.5000000000e-01, 6.5133855674e-02, 1.1999999951e-01, 7.5000000000e-02, -2.6340677964e-01, -0.0000000000e+00],
    [4.0000000000e-02, 2.4000000000e-01, 5.0000000000e-01, 2.2000000000e-01, -8.0000000000e-02, -5.0000000000e-02, -3.8000000000e-01, 1.4000000000e-01],
    [0.0000000000e+00, -2.9568562174e+00, -2.5391224124e+00, 4.0572293600e+00, 3.0264843646e+00, -4.5282419851e-01, 2.5527002333e+00, -8.0032180636e+00],
];

fn recording() -> Recording {
    Recording {
        name: "rec".into(),
        time_s: TIME.to_vec().into(),
        deflection_rad: Some(DEFLECTION_MRAD.map(|x| 1e-3 * x).to_vec().into()),
        theta_out_rad: Some(OUTPUT.to_vec().into()),
        velocity_out_rad_per_s: Some(VELOCITY.to_vec().into()),
        temperature_c: Some(TEMPERATURE.to_vec().into()),
        torque_sim_nm: Some(SIMULATED_TORQUE.to_vec().into()),
        ..Recording::default()
    }
}

fn model(terms: &[(&str, &str)]) -> Model {
    let tables = terms.iter().map(|(kind, keys)| format!("[[term]]\nkind = \"{kind}\"\n{keys}\n"));
    parse("m.toml", &(PUBLISHED.to_owned() + &tables.collect::<String>())).unwrap()
}

fn assert_close(found: &[f64], expected: &[f64], what: &str) {
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-9);
    assert!(found.len() == expected.len() && near, "{what}\nfound    {found:?}\nexpected {expected:?}");
}

#[test]
fn each_kind_alone_is_that_of_the_reference() {
    for (kind, keys, expected) in KINDS {
        let prediction = predict(&model(&[(kind, keys)]), None, &recording()).unwrap();
        let base: Vec<f64> = prediction.elastic.iter().zip(&prediction.hysteresis).map(|(f, z)| f + z).collect();
        assert_close(&base, &BASE, "base");
        assert_eq!(prediction.terms[0].0, *kind);
        assert_close(&prediction.terms[0].1, expected, &format!("{kind}\n{keys}"));
    }
    for kind in gmhm::terms::KINDS {
        assert!(KINDS.iter().any(|(name, ..)| *name == kind.name), "{} has no reference", kind.name);
    }
}

#[test]
fn terms_are_added_one_at_a_time_in_file_order() {
    let several = model(&[
        ("coulomb_friction", "torque_nm = 0.7\nsmoothing_rad_per_s = 0.05"),
        ("load_dependent_friction", "mu = 0.03\nsmoothing_rad_per_s = 0.1"),
        ("viscous_damping", "damping_nms_per_rad = 150"),
        ("thermal_friction", "per_k = 0.02\nreference_c = 22"),
        ("encoder_eccentricity", "cos_rad = 4e-5\nsin_rad = -6e-5"),
        ("time_skew", "delay_s = 0.03"),
        ("coulomb_friction", "torque_nm = 0.2"),
    ]);
    let prediction = predict(&several, None, &recording()).unwrap();
    let names: Vec<&str> = prediction.terms.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!((names[0], names[6]), ("coulomb_friction", "coulomb_friction_2"));
    let mut total = BASE;
    for ((name, column), expected) in prediction.terms.iter().zip(&SEVERAL) {
        assert_close(column, expected, name);
        total.iter_mut().zip(expected).for_each(|(sum, x)| *sum += x);
    }
    assert_close(&prediction.torque, &total, "total");
}

const JOINT_LOG: &str = "format = 1\n[gear]\nratio = 100\ntorque_side = \"motor\"\n\
    [[term]]\nkind = \"gravity_load\"\ncos_nm = 3\nsin_nm = -1.5\n\
    [[term]]\nkind = \"load_dependent_friction\"\nmu = 0.03\nsmoothing_rad_per_s = 0.1\n\
    [[term]]\nkind = \"inertia\"\ninertia_kgm2 = 0.2\n\
    [[term]]\nkind = \"torque_ripple\"\norders = [2]\ncos_nm = [0.3]\nsin_nm = [0.1]\n";

#[test]
fn a_joint_log_needs_no_gear() {
    let joint = Recording { deflection_rad: None, ..recording() };
    let prediction = predict(&parse("m.toml", JOINT_LOG).unwrap(), None, &joint).unwrap();
    assert_eq!((prediction.elastic.as_slice(), prediction.hysteresis.as_slice()), (&[0.0; 8][..], &[0.0; 8][..]));
    for ((name, column), expected) in prediction.terms.iter().zip(&JOINT) {
        assert_close(column, expected, name);
    }
}

const SIMULATION: &str = "format = 1\n[gear]\nbase = \"simulation\"\n\
    [[term]]\nkind = \"gravity_load\"\ncos_nm = 0.8\nsin_nm = 0.1\n\
    [[term]]\nkind = \"load_dependent_friction\"\nmu = 0.03\nsmoothing_rad_per_s = 0.1\n\
    [[term]]\nkind = \"torque_scale\"\ngain_error = 0.02\n\
    [[term]]\nkind = \"time_skew\"\ndelay_s = 0.03\n";

#[test]
fn terms_are_added_to_a_simulation() {
    let model = parse("m.toml", SIMULATION).unwrap();
    let prediction = predict(&model, None, &recording()).unwrap();
    let mut total = SIMULATED_TORQUE;
    for ((name, column), expected) in prediction.terms.iter().zip(&SIMULATED) {
        assert_close(column, expected, name);
        total.iter_mut().zip(expected).for_each(|(sum, x)| *sum += x);
    }
    assert_close(&prediction.torque, &total, "total");
    assert_close(&prediction.elastic, &[0.0; 8], "elastic");
    let bare = Recording { torque_sim_nm: None, ..recording() };
    let refused = predict(&model, None, &bare);
    assert!(matches!(refused, Err(PredictError::NoSimulation(_))), "{refused:?}");
    // Nothing found is a model, too: the simulation is right.
    let nothing = parse("m.toml", "format = 1\n[gear]\nbase = \"simulation\"\n").unwrap();
    assert_close(&predict(&nothing, None, &recording()).unwrap().torque, &SIMULATED_TORQUE, "nothing found");
    // Elements under load refer to A, which a model without gear has to state.
    let memory =
        "[[term]]\nkind = \"load_dependent_memory\"\nradius_rad = [3e-4]\ntorque_nm = [0.5]\nload_quadratic = 0.6\n";
    let rated = SIMULATION.replace("base", "rated_deflection_rad = 1.168e-3\nbase");
    let with_memory = predict(&parse("m.toml", &(rated + memory)).unwrap(), None, &recording()).unwrap();
    let (.., alone) = KINDS.iter().find(|(_, keys, _)| keys.contains("load_quadratic = 0.6")).unwrap();
    let late = with_memory.terms.iter().find(|(name, _)| name == "load_dependent_memory").unwrap();
    // The skew before it delays it: rows between which it does not move are told exactly.
    assert!((late.1[0] - alone[0]).abs() < 1e-12);
    let no_deflection = Recording { deflection_rad: None, ..recording() };
    let unrated = predict(&parse("m.toml", &(SIMULATION.to_owned() + memory)).unwrap(), None, &no_deflection);
    assert!(matches!(unrated, Err(PredictError::Term { .. })), "{unrated:?}");
}

#[test]
fn the_command_needs_no_motion_for_a_simulation_whose_terms_need_none() {
    let dir = WorkDir::new();
    let model = "format = 1\n[gear]\nbase = \"simulation\"\n[[term]]\nkind = \"torque_scale\"\ngain_error = -0.5\n";
    dir.write("m.toml", model).write("rec.csv", "time_s,torque_sim_nm\n0,2\n0.1,-4\n");
    dir.succeed("predict m.toml rec.csv -o out.csv");
    assert_eq!(dir.column("out.csv", "torque_model_nm"), [1.0, -2.0]);
    assert_eq!(dir.column("out.csv", "torque_scale_nm"), [-1.0, 2.0]);
    dir.write("bare.csv", "time_s,theta_out_rad\n0,2\n0.1,-4\n");
    dir.refuse("predict m.toml bare.csv -o none.csv", &["bare.csv", "torque_sim_nm is missing", "simulation"]);
    dir.write("m.toml", PUBLISHED.replace("[gear]", "[gear]\nbase = \"simulation\""));
    dir.refuse("predict m.toml rec.csv -o none.csv", &["m.toml", "[elastic]", "simulation"]);
}

#[test]
fn an_order_of_the_output_is_above_one() {
    let keys = "angle = \"output\"\norders = [2, 1]\ncos_nm = [1, 1]\nsin_nm = [1, 1]\n";
    let text = format!("{JOINT_LOG}[[term]]\nkind = \"torque_ripple\"\n{keys}");
    let error = parse("m.toml", &text).unwrap_err().to_string();
    assert!(error.contains("orders") && error.contains("greater than one"), "{error}");
    assert!(parse("m.toml", &text.replace("output", "motor")).is_ok());
}

#[test]
fn the_command_writes_a_column_a_term() {
    let dir = WorkDir::new();
    let terms = "[[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 1.25\n\
        [[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = -0.25\n";
    let rows = (0..8).map(|k| format!("{},{}e-3,{}\n", TIME[k], DEFLECTION_MRAD[k], VELOCITY[k]));
    let text = "time_s,deflection_rad,velocity_out_rad_per_s\n".to_owned() + &rows.collect::<String>();
    dir.write("m.toml", PUBLISHED.to_owned() + terms).write("rec.csv", text);
    dir.succeed("predict m.toml rec.csv -o out.csv");
    let header = dir.read("out.csv").lines().next().unwrap().to_owned();
    assert!(header.ends_with("torque_model_nm,elastic_nm,hysteresis_nm,viscous_friction_nm,viscous_friction_2_nm"));
    let second = dir.column("out.csv", "viscous_friction_2_nm");
    assert_close(&second, &VELOCITY.map(|v| 0.25 * v), "viscous_friction_2_nm");
    let parts = ["elastic_nm", "hysteresis_nm", "viscous_friction_nm", "viscous_friction_2_nm"];
    let parts = parts.map(|name| dir.column("out.csv", name));
    for (row, total) in dir.column("out.csv", "torque_model_nm").iter().enumerate() {
        let sum: f64 = parts.iter().map(|p| p[row]).sum();
        assert!((total - sum).abs() < 1e-13);
    }
    dir.write("m.toml", (PUBLISHED.to_owned() + terms).replace("_nm_per", "_a_per").replace("_nms_per", "_as_per"));
    dir.succeed("predict m.toml rec.csv -o amperes.csv");
    assert!(dir.read("amperes.csv").lines().next().unwrap().ends_with(",viscous_friction_2_a"));
    dir.write(
        "m.toml",
        PUBLISHED.to_owned() + "[[term]]\nkind = \"thermal_zero_drift\"\nnm_per_k = 1\nreference_c = 20\n",
    );
    dir.refuse("predict m.toml rec.csv -o out2.csv", &["rec.csv", "`thermal_zero_drift`", "temperature_c is missing"]);
}

#[test]
fn a_term_without_its_column_is_refused() {
    let bare = || Recording {
        name: "rec".into(),
        deflection_rad: recording().deflection_rad,
        time_s: TIME.to_vec().into(),
        ..Recording::default()
    };
    for (kind, keys, _) in KINDS {
        let model = model(&[(kind, keys)]);
        let info = model.terms[0].info().unwrap();
        let needed = predict(&model, None, &bare());
        let of_deflection = [
            "viscous_damping",
            "soft_windup",
            "stiffness_asymmetry",
            "backlash",
            "nonlocal_memory",
            "load_dependent_memory",
            "creep",
        ];
        let of_nothing = ["time_skew", "sensor_drift", "wear"];
        let tells =
            of_deflection.contains(kind) || of_nothing.contains(kind) || keys.contains("coordinate = \"torque\"");
        match needed {
            Ok(_) => assert!(tells, "{kind}"),
            Err(PredictError::MissingSignal { kind: named, .. }) => assert!(!tells && named == info.name, "{kind}"),
            Err(other) => panic!("{kind}: {other}"),
        }
    }
    let no_gear = JOINT_LOG
        .replace("kind = \"inertia\"\ninertia_kgm2 = 0.2", "kind = \"thermal_stiffness\"\nper_k = 1\nreference_c = 1");
    let refused = predict(&parse("m.toml", &no_gear).unwrap(), None, &recording());
    assert!(matches!(refused, Err(PredictError::NoGear(_))), "{refused:?}");
}

#[test]
fn huge_parameters_are_refused_not_written() {
    let huge = model(&[
        ("torque_ripple", "orders = [1e300]\ncos_nm = [1e308]\nsin_nm = [-1.7e308]"),
        ("sensor_drift", "nm_per_s = 1.7e308"),
        ("sensor_drift", "nm_per_s = 1.7e308"),
    ]);
    let refused = predict(&huge, None, &recording());
    assert!(matches!(refused, Err(PredictError::NotFinite { .. })), "{refused:?}");
}
