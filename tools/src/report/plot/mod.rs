//! Figures as SVG: bounded in size whatever the length of the data, legible on light and dark pages, in colours that colour-blind
//! eyes can tell apart (Okabe, Ito, "Color Universal Design", 2008).

mod bars;
mod decimate;
mod figure;
mod heat;
mod interactive;

pub use bars::Bars;
pub use figure::{Curve, Figure, Level, Phase, Style};
pub use heat::{HeatMap, Side};

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// What a curve stands for decides its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// What was measured: grey.
    Measured,
    /// The model: blue.
    Model,
    /// A second curve beside the model: vermilion.
    Second,
    /// A third one: green.
    Third,
    /// A fourth one: purple.
    Fourth,
}

impl Role {
    fn colour(self) -> RGBColor {
        match self {
            Self::Measured => RGBColor(0x80, 0x80, 0x80),
            Self::Model => RGBColor(0x00, 0x72, 0xB2),
            Self::Second => RGBColor(0xD5, 0x5E, 0x00),
            Self::Third => RGBColor(0x00, 0x9E, 0x73),
            Self::Fourth => RGBColor(0xCC, 0x79, 0xA7),
        }
    }
}

/// A finished figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawing {
    title: String,
    height: u32,
    body: String,
    /// What the script of a page draws it anew from, JSON; empty where it stays as it is.
    data: String,
}

impl Drawing {
    /// As a file of its own, with its colours for dark viewers.
    pub fn to_file(&self) -> String {
        let style = format!("<style>{}</style>", dark("", ""));
        let from = format!(
            "<svg width=\"{WIDTH}\" height=\"{}\" viewBox=\"{}\" xmlns=\"http://www.w3.org/2000/svg\">",
            self.height,
            self.view()
        );
        format!("{from}\n<title>{}</title>\n{style}\n{}</svg>\n", escaped(&self.title), self.body)
    }

    /// As an element of a page, which brings the colours with [`style`], and its data for the script of the page.
    pub fn to_element(&self) -> String {
        let title = escaped(&self.title);
        let svg =
            format!("<svg viewBox=\"{}\" role=\"img\" aria-label=\"{title}\">\n{}</svg>\n", self.view(), self.body);
        if self.data.is_empty() {
            return svg;
        }
        format!("{svg}<script type=\"application/json\">{}</script>\n", self.data)
    }

    fn with_data(mut self, data: String) -> Self {
        self.data = data;
        self
    }

    fn view(&self) -> String {
        format!("0 0 {} {}", WIDTH * SHARPNESS, self.height * SHARPNESS)
    }
}

/// The style sheet that turns paper and ink about on a dark page; on paper they stay.
pub fn style() -> String {
    dark("svg ", "screen and ")
}

/// Size of a figure, pixels.
const WIDTH: u32 = 680;
const HEIGHT: u32 = 440;
/// Sizes of letters, pixels.
const TITLE: u32 = 22;
const AXIS: u32 = 19;
const WORDS: u32 = 17;
/// Coordinates a pixel: they are whole numbers.
const SHARPNESS: u32 = 2;

const GRID: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);

fn dark(within: &str, medium: &str) -> String {
    let colours = [
        ("fill", "#FFFFFF", "#16181d"),
        ("fill", "#000000", "#e6e6e6"),
        ("stroke", "#000000", "#e6e6e6"),
        ("fill", "#DDDDDD", "#3a3d45"),
        ("stroke", "#DDDDDD", "#3a3d45"),
        ("stroke", "#0072B2", "#56b4e9"),
        ("fill", "#0072B2", "#56b4e9"),
    ];
    let rules: String =
        colours.iter().map(|(what, from, to)| format!("{within}[{what}=\"{from}\"]{{{what}:{to}}}")).collect();
    format!("@media {medium}(prefers-color-scheme:dark){{{rules}}}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn<'a> = Result<(), Box<dyn std::error::Error + 'a>>;

/// Draws on a white canvas.
fn drawing(title: &str, draw: impl FnOnce(&Canvas<'_>) -> Result<(), String>) -> Drawing {
    drawing_of(HEIGHT, title, draw)
}

/// The same in another height, pixels.
fn drawing_of(height: u32, title: &str, draw: impl FnOnce(&Canvas<'_>) -> Result<(), String>) -> Drawing {
    let mut svg = String::new();
    {
        let canvas = SVGBackend::with_string(&mut svg, (WIDTH * SHARPNESS, height * SHARPNESS)).into_drawing_area();
        // Nothing can fail: the canvas is a string.
        let _ = canvas.fill(&WHITE).map_err(|e| e.to_string()).and_then(|()| draw(&canvas));
        let _ = canvas.present();
    }
    let body = svg.split_once('>').map_or("", |(_, rest)| rest);
    let body = body.rsplit_once("</svg>").map_or(body, |(inside, _)| inside);
    Drawing { title: title.to_owned(), height, body: joined_dots(body), data: String::new() }
}

/// Neighbouring dots of one size and colour as one path: a tenth of the bytes.
fn joined_dots(body: &str) -> String {
    let mut joined = String::with_capacity(body.len() / 4);
    let mut open: Option<&str> = None;
    for line in body.lines() {
        let dot = line.strip_prefix("<circle cx=\"").and_then(|rest| {
            let (x, rest) = rest.split_once("\" cy=\"")?;
            let (y, rest) = rest.split_once("\" ")?;
            Some((x, y, rest))
        });
        if open.is_some() && dot.map(|(.., look)| look) != open {
            joined += "\"/>\n";
            open = None;
        }
        let Some((x, y, look)) = dot else {
            joined += line;
            joined.push('\n');
            continue;
        };
        if open.is_none() {
            let value =
                |name: &str| look.split_once(&format!("{name}=\"")).and_then(|(_, rest)| rest.split('"').next());
            let (radius, colour) = (value("r").and_then(|r| r.parse().ok()).unwrap_or(1.0_f64), value("fill"));
            let (width, colour) = (2.0 * radius, colour.unwrap_or("#000000"));
            joined += &format!(
                "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\" d=\""
            );
            open = Some(look);
        }
        joined += &format!("M{x} {y}h0");
    }
    if open.is_some() {
        joined += "\"/>\n";
    }
    joined
}

/// A font size in figure pixels.
fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size * SHARPNESS).into_font().color(&BLACK)
}

fn anchored(size: u32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    font(size).pos(Pos::new(horizontal, vertical))
}

const fn px(pixels: u32) -> u32 {
    pixels * SHARPNESS
}

/// The title above the middle.
fn head<'a>(canvas: &Canvas<'a>, title: &str) -> Drawn<'a> {
    let place = (px(WIDTH / 2) as i32, px(14) as i32);
    Ok(canvas.draw(&Text::new(title, place, anchored(TITLE, HPos::Center, VPos::Top)))?)
}

/// Where the labels of a legend stand: x offset and line of each, and the number of lines.
fn legend_places<'l>(labels: impl Iterator<Item = &'l str>) -> (Vec<(i32, i32)>, u32) {
    let (mut x, mut line) = (72, 0);
    let mut places = Vec::new();
    for label in labels {
        let width = 48 + (label.chars().count() as f64 * 7.8) as i32;
        if x + width > WIDTH as i32 - 16 && x > 72 {
            (x, line) = (72, line + 1);
        }
        places.push((x, line));
        x += width;
    }
    let lines = if places.is_empty() { 0 } else { line as u32 + 1 };
    (places, lines)
}

/// The values' range with a little room; never empty.
fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let finite = values.filter(|v| v.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return -1.0..1.0;
    }
    let room = 0.05 * (high - low);
    let room = if room > 0.0 { room } else { 0.5 * if high == 0.0 { 1.0 } else { high.abs() } };
    low - room..high + room
}
