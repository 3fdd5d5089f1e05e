//! A page of everything that a page can hold: self-contained, well nested, bounded in size, light and dark in a browser.

use crate::browser::{after_script, assert_light_and_dark, assert_self_contained, assert_works, told};
use gmhm_tools::fit::verdict::Grade;
use gmhm_tools::recording::TorqueUnit;
use gmhm_tools::report::figures::{self, Abscissa, TrendAxis};
use gmhm_tools::report::page::{Input, Page, Provenance, Section, Table, TableRow, Verdict};
use gmhm_tools::report::plot::{Curve, Figure, HeatMap, Phase, Role, Side, Style};

const UNIT: TorqueUnit = TorqueUnit::NewtonMetre;

/// Everything at once, from so many rows.
fn gallery(rows: usize) -> Page {
    let phase: Vec<f64> = (0..rows).map(|k| 6.0 * std::f64::consts::TAU * k as f64 / 3000.0).collect();
    let time: Vec<f64> = (0..rows).map(|k| k as f64 * 1e-2).collect();
    let theta: Vec<f64> = phase.iter().map(|p| 1.168e-3 * p.sin()).collect();
    let model: Vec<f64> = phase.iter().map(|p| 30.0 * p.sin() + 3.0 * p.cos()).collect();
    let noise = |k: usize| ((k as f64 * 12.9898).sin() * 43_758.545).fract() - 0.5;
    let measured: Vec<f64> = model.iter().enumerate().map(|(k, m)| m + noise(k)).collect();
    let left: Vec<f64> = measured.iter().zip(&model).map(|(a, b)| a - b).collect();
    let elastic: Vec<f64> = phase.iter().map(|p| 30.0 * p.sin()).collect();
    let memory: Vec<f64> = phase.iter().map(|p| 3.0 * p.cos()).collect();
    let lines: Vec<(f64, f64)> =
        (1..rows.min(60_000)).map(|k| (0.02 * k as f64, 0.02 + 0.02 * noise(k).abs())).collect();
    let curves = [("GMHM", Role::Model, &model[..])];
    let heat = (0..64).map(|r| (0..400).map(|c| (0.1 * f64::from(r)).sin() * (0.02 * f64::from(c)).cos()).collect());
    let names = ["c1_nm_per_rad", "c2_nm_per_rad3", "c3_nm_per_rad5", "e", "h", "rho"];
    let matrix: Vec<Vec<f64>> = (0..6)
        .map(|r| (0..6).map(|c| if r == c { 1.0 } else { f64::from((r * c) % 5) / 2.5 - 1.0 }).collect())
        .collect();
    let axis =
        TrendAxis { label: "recording".into(), names: ["2024", "2025", "2026"].map(Into::into).into(), values: None };
    let warm = TrendAxis { label: "temperature in °C".into(), values: Some(vec![20.0, 35.0, 50.0]), ..axis.clone() };
    let points = [(24_700.0, Some(120.0)), (24_300.0, Some(150.0)), (23_500.0, None)];
    let heat = HeatMap {
        title: "Residual over time and motor angle".into(),
        legend: "mean residual in N·m".into(),
        x: Side::Numbers { label: "time in s".into(), from: 0.0, to: 60.0 },
        y: Side::Numbers { label: "motor angle in rad".into(), from: 0.0, to: std::f64::consts::TAU },
        values: heat.collect(),
        limit: None,
        numbers: false,
    };
    Page {
        title: "Gear <7> & its loop".into(),
        verdict: Verdict {
            grade: Grade::Caution,
            sentence: "Good enough to flash up to 1.1 mrad; c3 is not determined.".into(),
            reasons: vec![
                "0.05 N·m rms are left in blocks held out".into(),
                "no stroke reached the rated deflection".into(),
            ],
        },
        sections: vec![
            Section::new("The loop").figure(
                figures::hysteresis_loop("Hysteresis loop", &theta, &measured, &curves, UNIT),
                "Grey: recording. Blue: model.",
            ),
            Section::new("What is left")
                .text("The residual is what the recording says beyond the model.")
                .figures([
                    (
                        figures::residual_over_time(
                            "Residual over time",
                            &time,
                            &[("", Role::Model, &left)],
                            &[(4.0, 8.0)],
                            UNIT,
                        ),
                        "Shaded: seconds that stand out.".into(),
                    ),
                    (
                        figures::residual_by_direction(
                            "Residual over deflection",
                            Abscissa::DEFLECTION,
                            &theta,
                            &left,
                            UNIT,
                        ),
                        "By direction.".into(),
                    ),
                ])
                .figures([
                    (
                        figures::decomposition("Parts", &theta, &elastic, &memory, UNIT),
                        "Elastic and hysteresis.".into(),
                    ),
                    (
                        figures::spectrum(
                            "Order spectrum",
                            "order of the motor turn",
                            "amplitude in N·m",
                            &lines,
                            Some(0.05),
                            &[(2.0, 0.4), (4.0, 0.12)],
                        ),
                        "Two orders stand out.".into(),
                    ),
                    (heat.draw(), "Blue is positive.".into()),
                    (figures::correlation(&names, &matrix), "Strong colours: not told apart.".into()),
                    (figures::trend("c1", &axis, "c1 in N·m/rad", &points, &[]), "Falls.".into()),
                    (
                        figures::trend("c1", &warm, "c1 in N·m/rad", &points, &[(20.0, 24_700.0), (50.0, 23_500.0)]),
                        "Falls.".into(),
                    ),
                ]),
            Section::new("Parameters").table(Table {
                caption: "With intervals of two standard deviations".into(),
                head: ["parameter", "value", "± 2 sd", "unit"].map(Into::into).into(),
                rows: vec![
                    TableRow::new(["c1", "24737", "31", "N·m/rad"]).chosen(true),
                    TableRow::new(["c3", "−1.18·10¹⁴", "2.5·10¹⁴", "N·m/rad⁵"]).flagged(true),
                ],
            }),
            Section::new("Notes").notes(["c3 <undetermined>".to_owned()]),
        ],
        provenance: Provenance {
            command: "gmhm fit 'a b.csv' -o gear.toml".into(),
            inputs: vec![Input { name: "a b.csv".into(), sha256: "0123456789abcdef".repeat(4), rows: Some(rows) }],
            seed: Some(1),
        },
    }
}

#[test]
fn a_page_is_self_contained_and_well_nested() {
    let html = gallery(3000).to_html();
    assert_self_contained(&html);
    for words in [
        "Gear &#60;7&#62; &#38; its loop",
        "c3 &#60;undetermined&#62;",
        "SHA-256",
        "prefers-color-scheme:dark",
        "gmhm fit",
    ] {
        assert!(html.contains(words), "{words}");
    }
    let verdict = html.find("Good enough to flash").unwrap();
    assert!(verdict < html.find("<svg").unwrap(), "the verdict comes first");
}

#[test]
fn a_million_rows_make_no_larger_a_page() {
    assert_self_contained(&gallery(1_000_000).to_html());
}

#[test]
fn a_page_without_anything_is_whole() {
    let mut page = gallery(0);
    assert_self_contained(&page.to_html());
    page.sections.clear();
    assert_self_contained(&page.to_html());
}

#[test]
fn a_browser_shows_it_light_and_dark() {
    let folder = tempfile::tempdir().unwrap();
    let html = folder.path().join("page.html");
    std::fs::write(&html, gallery(3000).to_html()).unwrap();
    assert_works(&html);
    assert_light_and_dark(&html);
}

/// Moves the pointer over figures, presses keys and buttons, and writes down what the page says then.
const VISITOR: &str = r#"
const told = {}, figures = [...document.querySelectorAll("svg.live")];
const by = words => figures.find(svg => svg.getAttribute("aria-label").startsWith(words));
const move = (svg, kind, x, y, more) => {
  const box = svg.getBoundingClientRect();
  svg.dispatchEvent(new PointerEvent(kind, { clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true, ...more }));
};
const values = svg => svg.closest("figure").querySelector(".values").textContent;
const numbers = svg => [...svg.querySelectorAll("text.number")].map(text => text.textContent).join(" ");
const [loop, time] = [by("Hysteresis loop"), by("Residual over time")];
move(loop, "pointermove", 0.55, 0.5);
told.hover = values(loop);
told.linked = values(time);
told.before = numbers(loop);
move(loop, "pointerdown", 0.4, 0.3, { button: 0 });
move(loop, "pointermove", 0.6, 0.6);
move(loop, "pointerup", 0.6, 0.6);
told.zoomed = numbers(loop);
loop.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", shiftKey: true, bubbles: true }));
told.moved = numbers(loop);
loop.dispatchEvent(new KeyboardEvent("keydown", { key: "0", bubbles: true }));
told.whole = numbers(loop);
time.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", bubbles: true }));
time.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true }));
told.key = values(time);
const paths = svg => svg.querySelectorAll("path.line, path.dots").length;
const count = paths(loop);
loop.closest("figure").querySelector(".legend button").click();
told.toggled = count - paths(loop);
const phased = by("Before and after");
told.both = paths(phased);
document.querySelector(".phases input[value=after]").click();
told.after = paths(phased);
const heat = document.querySelector("svg[aria-label^='Residual over time and']");
move(heat, "pointermove", 0.5, 0.5);
told.heat = values(heat);
document.title = JSON.stringify(told);
"#;

#[test]
fn a_reader_zooms_reads_and_switches() {
    let folder = tempfile::tempdir().unwrap();
    let html = folder.path().join("page.html");
    let mut page = gallery(20_000);
    let x: Vec<f64> = (0..50).map(f64::from).collect();
    let curve = |role, phase| Curve::new("residual", role, &x, 1.0, &x).styled(Style::Dots).in_phase(Some(phase));
    let curves = vec![curve(Role::Second, Phase::Before), curve(Role::Model, Phase::After)];
    let figure = Figure { title: "Before and after".into(), curves, ..Figure::default() };
    page.sections.push(Section::new("Two states").figure(figure.draw(), "Both."));
    std::fs::write(&html, page.to_html()).unwrap();
    let Some(dom) = after_script(&html, VISITOR) else { return };
    let told = told(&dom);
    let text = |key: &str| told[key].as_str().unwrap_or_else(|| panic!("{key} in {told}"));
    assert!(text("hover").contains("deflection θ in mrad: ") && text("hover").contains("GMHM: "), "{told}");
    assert!(text("linked").starts_with("time in s: "), "{told}");
    assert!(text("zoomed") != text("before") && text("moved") != text("zoomed"), "{told}");
    assert_eq!(text("whole"), text("before"));
    assert!(text("key").starts_with("time in s: 0"), "{told}");
    assert_eq!((&told["toggled"], &told["both"], &told["after"]), (&1.into(), &2.into(), &1.into()), "{told}");
    assert!(text("heat").contains("mean residual in N·m: "), "{told}");
}
