//! Curves, dots, stems and columns over a horizontal axis.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use serde::Serialize;

use super::decimate::{self, Window};
use super::interactive::{self, Interactive};
use super::{
    AXIS, Canvas, Drawing, GRID, HEIGHT, Role, SHARPNESS, WORDS, anchored, drawing, font, head, legend_places, px,
    range,
};
use crate::number::tick;

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// A line through the points.
    Line,
    /// A dot a point.
    Dots,
    /// A vertical line from zero and a dot: lines of a spectrum.
    Stems,
}

/// Which state of a model a curve shows; the reader of a page switches between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Before an extension.
    Before,
    /// After it.
    After,
}

/// One curve, or one cloud of dots.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Words of the legend.
    pub label: String,
    /// Its points in order; points that are not finite are left out, and break a line.
    pub points: Vec<(f64, f64)>,
    /// What it stands for.
    pub role: Role,
    /// How it is drawn.
    pub style: Style,
    /// Half the height of an error bar at each point; none where empty.
    pub error: Vec<f64>,
    /// Whether it shows the state before or after an extension.
    pub phase: Option<Phase>,
}

impl Curve {
    /// A curve of x, scaled to the unit of the axis, and y: dots for what was measured, else a line.
    pub fn new(label: impl Into<String>, role: Role, x: &[f64], scale: f64, y: &[f64]) -> Self {
        let style = if role == Role::Measured { Style::Dots } else { Style::Line };
        Self::through(label, role, style, x.iter().zip(y).map(|(x, y)| (x * scale, *y)).collect())
    }

    /// A curve through points in the units of the axes.
    pub fn through(label: impl Into<String>, role: Role, style: Style, points: Vec<(f64, f64)>) -> Self {
        Self { label: label.into(), points, role, style, error: Vec::new(), phase: None }
    }

    /// Drawn in another way.
    #[must_use]
    pub fn styled(mut self, style: Style) -> Self {
        self.style = style;
        self
    }

    /// Of the state before or after an extension.
    #[must_use]
    pub fn in_phase(mut self, phase: Option<Phase>) -> Self {
        self.phase = phase;
        self
    }

    fn places(&self) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().map(|p| p.0)
    }

    fn heights(&self) -> impl Iterator<Item = f64> + '_ {
        let error = |k: usize| self.error.get(k).copied().filter(|e| e.is_finite()).unwrap_or(0.0);
        let ends = self.points.iter().enumerate().flat_map(move |(k, p)| [p.1 - error(k), p.1 + error(k)]);
        let zero = (self.style == Style::Stems).then_some(0.0);
        ends.chain(zero)
    }
}

/// A horizontal line at a height.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// What it is.
    pub label: String,
    /// Where.
    pub height: f64,
}

/// A figure: its curves are drawn in order.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Label of the vertical axis, with its unit.
    pub y_label: String,
    /// Curves.
    pub curves: Vec<Curve>,
    /// Ranges of the horizontal axis that stand out.
    pub shaded: Vec<std::ops::Range<f64>>,
    /// Horizontal lines.
    pub levels: Vec<Level>,
    /// Names at 0, 1, 2 … of the horizontal axis in place of numbers.
    pub x_names: Vec<String>,
    /// Whether the k-th point of every curve is row k of the recordings: figures of the same rows share a cursor on a page.
    pub by_row: bool,
}

/// Most names that are written along an axis.
const MOST_NAMES: usize = 12;

impl Figure {
    /// A figure of curves.
    pub fn of(
        title: impl Into<String>,
        x_label: impl Into<String>,
        y_label: impl Into<String>,
        curves: impl IntoIterator<Item = Curve>,
    ) -> Self {
        let (title, x_label, y_label) = (title.into(), x_label.into(), y_label.into());
        Self { title, x_label, y_label, curves: curves.into_iter().collect(), ..Self::default() }
    }

    /// Its curves have a point for each row of the recordings.
    #[must_use]
    pub fn by_row(mut self) -> Self {
        self.by_row = true;
        self
    }

    /// The figure drawn: less than 400 kB whatever the length of the curves.
    pub fn draw(&self) -> Drawing {
        let drawing = drawing(&self.title, |canvas| self.draw_on(canvas).map_err(|e| e.to_string()));
        drawing.with_data(interactive::json(&Interactive::new(self, &self.window())))
    }

    fn window(&self) -> Window {
        let (x, y) = self.ranges();
        let (_, lines) = legend_places(self.labels());
        Window { x, y, pixels: (560.0, f64::from(HEIGHT - 104 - 22 * lines)) }
    }

    fn labels(&self) -> impl Iterator<Item = &str> {
        self.curves.iter().map(|curve| curve.label.as_str()).filter(|label| !label.is_empty())
    }

    fn ranges(&self) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
        let x = if self.x_names.is_empty() {
            range(self.curves.iter().flat_map(Curve::places))
        } else {
            -0.5..self.x_names.len() as f64 - 0.5
        };
        let heights = self.curves.iter().flat_map(Curve::heights);
        (x, range(heights.chain(self.levels.iter().map(|l| l.height))))
    }

    fn draw_on<'a>(&self, canvas: &Canvas<'a>) -> super::Drawn<'a> {
        let (places, lines) = legend_places(self.labels());
        let header = 44 + 22 * lines;
        head(canvas, &self.title)?;
        let (x, y) = self.ranges();
        let (_, below) = canvas.split_vertically(px(header));
        let letters = [y.start, y.end].map(|v| tick(v, y.end - y.start).chars().count() as u32);
        let left = (34 + 9 * letters[0].max(letters[1])).max(76);
        let mut chart = ChartBuilder::on(&below)
            .margin_left(px(16))
            .margin_right(px(20))
            .margin_bottom(px(10))
            .x_label_area_size(px(50))
            .y_label_area_size(px(left))
            .build_cartesian_2d(x.clone(), y.clone())?;
        let name = |at: &f64| {
            let index = at.round();
            let near = (at - index).abs() < 1e-6 && index >= 0.0 && self.x_names.len() <= MOST_NAMES;
            let name = if near { self.x_names.get(index as usize) } else { None };
            name.map_or_else(String::new, |n| shortened(n, 70 / self.x_names.len().max(1)))
        };
        let (across, up) = (x.end - x.start, y.end - y.start);
        let (x_tick, y_tick) = (|v: &f64| tick(*v, across), |v: &f64| tick(*v, up));
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .label_style(font(WORDS))
            .axis_desc_style(font(AXIS))
            .axis_style(BLACK.stroke_width(SHARPNESS))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(SHARPNESS))
            .set_all_tick_mark_size(px(5));
        mesh.x_label_formatter(&x_tick).y_label_formatter(&y_tick);
        if !self.x_names.is_empty() {
            mesh.x_labels(2 * self.x_names.len() + 1).x_label_formatter(&name);
        }
        mesh.draw()?;
        for part in &self.shaded {
            let corners = [(part.start.max(x.start), y.start), (part.end.min(x.end), y.end)];
            chart.draw_series([Rectangle::new(corners, Role::Second.colour().mix(0.14).filled())])?;
        }
        for level in &self.levels {
            chart.draw_series(LineSeries::new(
                [(x.start, level.height), (x.end, level.height)],
                Role::Measured.colour().stroke_width(SHARPNESS),
            ))?;
            let place = (x.end - 0.005 * (x.end - x.start), level.height + 0.008 * (y.end - y.start));
            chart.draw_series([Text::new(level.label.clone(), place, anchored(WORDS, HPos::Right, VPos::Bottom))])?;
        }
        let window = self.window();
        for curve in &self.curves {
            draw_curve(&mut chart, curve, &window)?;
        }
        for (curve, (at, line)) in self.curves.iter().filter(|c| !c.label.is_empty()).zip(places) {
            let (at, middle) = (at * SHARPNESS as i32, (48 + 22 * line) * SHARPNESS as i32);
            let colour = curve.role.colour();
            let wide = px(22) as i32;
            match curve.style {
                Style::Line => canvas.draw(&PathElement::new(
                    [(at, middle), (at + wide, middle)],
                    colour.stroke_width(3 * SHARPNESS / 2),
                ))?,
                _ => canvas.draw(&Circle::new((at + wide / 2, middle), px(4), colour.filled()))?,
            }
            let words = anchored(WORDS, HPos::Left, VPos::Center);
            canvas.draw(&Text::new(curve.label.clone(), (at + px(28) as i32, middle), words))?;
        }
        Ok(())
    }
}

type Chart<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

fn draw_curve<'b>(chart: &mut Chart<'_, 'b>, curve: &Curve, window: &Window) -> super::Drawn<'b> {
    let points = decimate::finite(&curve.points);
    let colour = curve.role.colour();
    for (point, error) in curve.points.iter().zip(&curve.error).filter(|(p, e)| p.1.is_finite() && e.is_finite()) {
        let cap = 0.006 * (window.x.end - window.x.start);
        let (low, high) = (point.1 - error, point.1 + error);
        let bar = |from, to| PathElement::new([from, to], colour.stroke_width(SHARPNESS + 1));
        chart.draw_series([
            bar((point.0, low), (point.0, high)),
            bar((point.0 - cap, low), (point.0 + cap, low)),
            bar((point.0 - cap, high), (point.0 + cap, high)),
        ])?;
    }
    match curve.style {
        Style::Line => {
            for piece in decimate::line(&curve.points, window) {
                chart.draw_series(LineSeries::new(piece, colour.stroke_width(3 * SHARPNESS / 2)))?;
            }
        }
        Style::Dots => {
            // Wide enough to be seen on both sides of the line of a model.
            let many = if curve.role == Role::Measured { px(3) } else { px(2) };
            let radius = if points.len() > 100 { many } else { px(4) };
            let dots = decimate::dots(&points, window);
            chart.draw_series(dots.into_iter().map(|p| Circle::new(p, radius, colour.filled())))?;
        }
        Style::Stems => {
            let kept = decimate::highest(&points);
            let stem = |p: &(f64, f64)| PathElement::new([(p.0, 0.0), *p], colour.stroke_width(SHARPNESS));
            chart.draw_series(kept.iter().map(stem))?;
            let radius = if kept.len() > 100 { px(1) } else { px(3) };
            chart.draw_series(kept.iter().map(|p| Circle::new(*p, radius, colour.filled())))?;
        }
    }
    Ok(())
}

/// At most so many characters.
pub(super) fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most.max(3) {
        return text.to_owned();
    }
    text.chars().take(most.max(3) - 1).chain(['…']).collect()
}
