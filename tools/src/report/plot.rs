//! Figures of curves and dots as SVG: bounded in size whatever the length of the data, legible on light and dark pages, in colours
//! that colour-blind eyes can tell apart (Okabe, Ito, "Color Universal Design", 2008).

use plotters::prelude::*;

/// Buckets that a longer curve is cut into; each keeps its ends and its extremes.
const BUCKETS: usize = 400;
const SIZE: (u32, u32) = (860, 540);

/// What a curve stands for decides its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// What was measured: grey dots.
    Measured,
    /// The model.
    Model,
    /// A second curve beside the model.
    Second,
    /// A third one.
    Third,
}

impl Role {
    fn colour(self) -> RGBColor {
        match self {
            Self::Measured => RGBColor(0x80, 0x80, 0x80),
            Self::Model => RGBColor(0x00, 0x72, 0xB2),
            Self::Second => RGBColor(0xD5, 0x5E, 0x00),
            Self::Third => RGBColor(0x00, 0x9E, 0x73),
        }
    }
}

/// One curve, or one cloud of dots.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Words of the legend.
    pub label: String,
    /// Its points in order; points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
    /// What it stands for.
    pub role: Role,
}

impl Curve {
    /// A curve of x, scaled to the unit of the axis, and y.
    pub fn new(label: impl Into<String>, role: Role, x: &[f64], scale: f64, y: &[f64]) -> Self {
        Self { label: label.into(), points: x.iter().zip(y).map(|(x, y)| (x * scale, *y)).collect(), role }
    }
}

/// A figure: its curves are drawn in order.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Label of the vertical axis, with its unit.
    pub y_label: String,
    /// Curves.
    pub curves: Vec<Curve>,
}

impl Figure {
    /// The figure as an SVG file of less than 300 kB, whatever the length of the curves.
    pub fn to_svg(&self) -> String {
        let mut svg = String::new();
        // Nothing can fail: the canvas is a string.
        if self.draw(&mut svg).is_err() {
            svg.clear();
        }
        finished(&svg, &self.title)
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error + '_>> {
        let curves: Vec<Vec<(f64, f64)>> = self.curves.iter().map(|curve| decimated(&curve.points)).collect();
        let (x, y) = (range(curves.iter().flatten().map(|p| p.0)), range(curves.iter().flatten().map(|p| p.1)));
        let canvas = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        canvas.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&canvas)
            .caption(&self.title, ("sans-serif", 20))
            .margin(16)
            .x_label_area_size(48)
            .y_label_area_size(72)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 16))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .draw()?;
        for (curve, points) in self.curves.iter().zip(&curves) {
            let colour = curve.role.colour();
            let drawn = if curve.role == Role::Measured {
                chart.draw_series(points.iter().map(|p| Circle::new(*p, 2, colour.filled())))?
            } else {
                chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?
            };
            let words = drawn.label(&curve.label);
            if curve.role == Role::Measured {
                words.legend(move |(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
            } else {
                words.legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE)
            .border_style(GRID)
            .label_font(("sans-serif", 14))
            .draw()?;
        canvas.present()?;
        Ok(())
    }
}

/// One number a name, as horizontal bars from zero.
#[derive(Debug, Clone)]
pub struct Bars {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Names and numbers from top to bottom; numbers that are not finite have no bar. The first one stands out.
    pub bars: Vec<(String, f64)>,
}

impl Bars {
    /// The bars as an SVG file.
    pub fn to_svg(&self) -> String {
        let mut svg = String::new();
        // Nothing can fail: the canvas is a string.
        if self.draw(&mut svg).is_err() {
            svg.clear();
        }
        finished(&svg, &self.title)
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error + '_>> {
        let count = self.bars.len();
        let longest = self.bars.iter().map(|bar| bar.1).filter(|length| length.is_finite()).fold(0.0, f64::max);
        let canvas = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        canvas.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&canvas)
            .caption(&self.title, ("sans-serif", 20))
            .margin(16)
            .x_label_area_size(48)
            .y_label_area_size(40)
            .build_cartesian_2d(0.0..if longest > 0.0 { 1.05 * longest } else { 1.0 }, 0.0..count.max(1) as f64)?;
        chart
            .configure_mesh()
            .disable_y_axis()
            .disable_y_mesh()
            .x_desc(&self.x_label)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 16))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .draw()?;
        for (place, (name, length)) in self.bars.iter().rev().enumerate().filter(|(_, bar)| bar.1.is_finite()) {
            let role = if place + 1 == count { Role::Model } else { Role::Measured };
            let (low, high) = (place as f64 + 0.1, place as f64 + 0.45);
            chart.draw_series([Rectangle::new([(0.0, low), (*length, high)], role.colour().filled())])?;
            let words = format!("{name}   {length:.4}");
            chart.draw_series([Text::new(words, (0.005 * longest, place as f64 + 0.88), ("sans-serif", 14))])?;
        }
        canvas.present()?;
        Ok(())
    }
}

/// The file with its title and its colours for a dark page.
fn finished(svg: &str, title: &str) -> String {
    svg.replacen('>', &format!(">\n<title>{}</title>\n{STYLE}", escaped(title)), 1)
}

const GRID: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);

/// Turns paper and ink about on a dark page.
const STYLE: &str = "<style>@media (prefers-color-scheme:dark){[fill=\"#FFFFFF\"]{fill:#16181d}[fill=\"#000000\"]{fill:#e6e6e6}[stroke=\"#000000\"]{stroke:#e6e6e6}[stroke=\"#DDDDDD\"]{stroke:#3a3d45}[stroke=\"#0072B2\"]{stroke:#56b4e9}[fill=\"#0072B2\"]{fill:#56b4e9}}</style>";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The points of a curve in order; of a long one the ends and extremes of each bucket, so that no peak is lost.
fn decimated(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let finite: Vec<(f64, f64)> = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
    if finite.len() <= 4 * BUCKETS {
        return finite;
    }
    let mut kept = Vec::with_capacity(4 * BUCKETS);
    for bucket in finite.chunks(finite.len().div_ceil(BUCKETS)) {
        let by_height = |a: &usize, b: &usize| bucket[*a].1.total_cmp(&bucket[*b].1);
        let low = (0..bucket.len()).min_by(by_height).unwrap_or(0);
        let high = (0..bucket.len()).max_by(by_height).unwrap_or(0);
        let mut rows = [0, low, high, bucket.len() - 1];
        rows.sort_unstable();
        kept.extend(
            rows.iter().enumerate().filter(|(k, row)| *k == 0 || rows[k - 1] != **row).map(|(_, row)| bucket[*row]),
        );
    }
    kept
}

/// The values' range with a little room; never empty.
fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return -1.0..1.0;
    }
    let room = 0.05 * (high - low);
    let room = if room > 0.0 { room } else { 0.5 * high.abs().max(1.0) };
    low - room..high + room
}
