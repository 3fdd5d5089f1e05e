//! Numbers over a plane as colours.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::figure::shortened;
use super::interactive::{self, InteractiveHeat};
use super::{AXIS, Canvas, Drawing, Role, SHARPNESS, WORDS, anchored, drawing, font, head, px};
use crate::number::{number, tick};

/// What runs along a side of a heat map.
#[derive(Debug, Clone, PartialEq)]
pub enum Side {
    /// Names, one a cell: from left to right, from top to bottom.
    Names(Vec<String>),
    /// Numbers, evenly: from left to right, from bottom to top.
    Numbers {
        /// Label with the unit.
        label: String,
        /// First edge.
        from: f64,
        /// Last edge.
        to: f64,
    },
}

/// A heat map: blue for positive numbers, vermilion for negative ones, the page where there is nothing.
#[derive(Debug, Clone)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// What the colour means, with its unit.
    pub legend: String,
    /// Along the horizontal side.
    pub x: Side,
    /// Along the vertical side.
    pub y: Side,
    /// Rows of cells: the first at the top beside names, at the bottom beside numbers. Numbers that are not finite have no colour.
    pub values: Vec<Vec<f64>>,
    /// The number of the strongest colour; the largest one where absent.
    pub limit: Option<f64>,
    /// Whether each cell shows its number.
    pub numbers: bool,
}

/// Most cells along a side; of more, neighbours are drawn as one, the largest of them.
const MOST: (usize, usize) = (96, 40);

impl HeatMap {
    /// The map drawn: less than 500 kB whatever its size.
    pub fn draw(&self) -> Drawing {
        let mut data = String::new();
        let drawing =
            drawing(&self.title, |canvas| self.draw_on(canvas).map(|drawn| data = drawn).map_err(|e| e.to_string()));
        drawing.with_data(data)
    }

    /// Draws, and returns what the script of a page needs.
    fn draw_on<'a>(&self, canvas: &Canvas<'a>) -> Result<String, Box<dyn std::error::Error + 'a>> {
        let cells = coarse(&self.values);
        let (rows, columns) = (cells.len(), cells.first().map_or(0, Vec::len));
        let largest = cells.iter().flatten().filter(|v| v.is_finite()).fold(0.0, |a: f64, v| a.max(v.abs()));
        let limit = self.limit.unwrap_or(largest);
        let signed = cells.iter().flatten().any(|v| *v < 0.0);
        head(canvas, &self.title)?;
        self.draw_key(canvas, limit, signed)?;

        let left = match &self.y {
            Side::Names(names) => names.iter().map(|n| 20 + 9 * n.chars().count().min(20) as u32).max().unwrap_or(0),
            Side::Numbers { .. } => 76,
        };
        let (_, below) = canvas.split_vertically(px(70));
        let ends = |side: &Side, count: usize| match side {
            Side::Names(_) => (0.0, count.max(1) as f64),
            Side::Numbers { from, to, .. } if from < to => (*from, *to),
            Side::Numbers { .. } => (0.0, 1.0),
        };
        let (x, y) = (ends(&self.x, columns), ends(&self.y, rows));
        let mut chart = ChartBuilder::on(&below)
            .margin_left(px(16))
            .margin_right(px(24))
            .margin_bottom(px(10))
            .x_label_area_size(px(50))
            .y_label_area_size(px(left))
            .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
        let at = |(from, to): (f64, f64), k: usize, count: usize| from + (to - from) * k as f64 / count.max(1) as f64;
        let named_rows = matches!(self.y, Side::Names(_));
        for (row, values) in cells.iter().enumerate() {
            let from_bottom = if named_rows { rows - 1 - row } else { row };
            let (low, high) = (at(y, from_bottom, rows), at(y, from_bottom + 1, rows));
            for (column, value) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
                let (left, right) = (at(x, column, columns), at(x, column + 1, columns));
                if let Some(colour) = colour(*value, limit) {
                    chart.draw_series([Rectangle::new([(left, low), (right, high)], colour.filled())])?;
                }
                if self.numbers {
                    let middle = (0.5 * (left + right), 0.5 * (low + high));
                    let words = anchored(WORDS, HPos::Center, VPos::Center);
                    chart.draw_series([Text::new(tick((100.0 * value).round() / 100.0, 0.5), middle, words)])?;
                }
            }
        }
        let (x_tick, y_tick) = (|v: &f64| tick(*v, x.1 - x.0), |v: &f64| tick(*v, y.1 - y.0));
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh()
            .label_style(font(WORDS))
            .axis_desc_style(font(AXIS))
            .axis_style(BLACK.stroke_width(SHARPNESS))
            .set_all_tick_mark_size(px(5));
        match &self.x {
            Side::Names(_) => mesh.x_labels(0),
            Side::Numbers { label, .. } => mesh.x_desc(label).x_label_formatter(&x_tick),
        };
        match &self.y {
            Side::Names(_) => mesh.y_labels(0),
            Side::Numbers { label, .. } => mesh.y_desc(label).y_label_formatter(&y_tick),
        };
        mesh.draw()?;
        let place = |point: (f64, f64)| chart.backend_coord(&point);
        if let Side::Names(names) = &self.x {
            let most = 70 / names.len().max(1);
            for (k, name) in names.iter().enumerate() {
                let (at_x, at_y) = place((k as f64 + 0.5, y.0));
                let words = anchored(WORDS, HPos::Center, VPos::Top);
                canvas.draw(&Text::new(shortened(name, most), (at_x, at_y + px(10) as i32), words))?;
            }
        }
        if let Side::Names(names) = &self.y {
            for (k, name) in names.iter().enumerate() {
                let (at_x, at_y) = place((x.0, rows as f64 - k as f64 - 0.5));
                let words = anchored(WORDS, HPos::Right, VPos::Center);
                canvas.draw(&Text::new(shortened(name, 20), (at_x - px(8) as i32, at_y), words))?;
            }
        }
        let (across, down) = chart.plotting_area().get_pixel_range();
        let from_top: Vec<&Vec<f64>> = if named_rows { cells.iter().collect() } else { cells.iter().rev().collect() };
        let place = [across.start, down.start, across.end, down.end];
        let sides = [&self.x, &self.y];
        Ok(interactive::json(&InteractiveHeat::new(&self.title, &self.legend, sides, place, &from_top)))
    }

    /// Swatches from the lowest to the highest number.
    fn draw_key<'a>(&self, canvas: &Canvas<'a>, limit: f64, signed: bool) -> super::Drawn<'a> {
        let (top, bottom) = (px(42) as i32, px(56) as i32);
        let swatches = if signed { 9 } else { 5 };
        let value = |k: i32| if signed { f64::from(k - 4) / 4.0 } else { f64::from(k) / 4.0 };
        let left = px(88) as i32;
        let wide = px(24) as i32;
        for k in 0..swatches {
            if let Some(colour) = colour(value(k), 1.0) {
                let at = left + k * wide;
                canvas.draw(&Rectangle::new([(at, top), (at + wide, bottom)], colour.filled()))?;
            }
        }
        let end = left + swatches * wide;
        canvas.draw(&Rectangle::new([(left, top), (end, bottom)], super::GRID.stroke_width(SHARPNESS)))?;
        let number = if limit == 1.0 { "1".to_owned() } else { number(limit, 3) };
        let low = if signed { format!("−{number}") } else { "0".to_owned() };
        let middle = (top + bottom) / 2;
        let right = anchored(WORDS, HPos::Right, VPos::Center);
        canvas.draw(&Text::new(low, (left - px(6) as i32, middle), right))?;
        let words = anchored(WORDS, HPos::Left, VPos::Center);
        canvas.draw(&Text::new(format!("{number}\u{2003}{}", self.legend), (end + px(6) as i32, middle), words))?;
        Ok(())
    }
}

/// Strength is shown by opacity, so that nothing is the page itself, light or dark; text stays legible on the strongest.
fn colour(value: f64, limit: f64) -> Option<RGBAColor> {
    let strength = if limit > 0.0 { (value.abs() / limit).min(1.0) } else { 0.0 };
    let role = if value < 0.0 { Role::Second } else { Role::Model };
    (strength > 0.004).then(|| role.colour().mix((0.75 * strength * 100.0).round() / 100.0))
}

fn coarse(values: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let larger = |a: f64, b: &f64| if b.abs() > a.abs() || !a.is_finite() { *b } else { a };
    let (down, across) =
        (values.len().div_ceil(MOST.1).max(1), values.first().map_or(0, Vec::len).div_ceil(MOST.0).max(1));
    values
        .chunks(down)
        .map(|rows| {
            let columns = rows.iter().map(Vec::len).min().unwrap_or(0).div_ceil(across);
            let cell = |c: usize| {
                let in_row = |row: &Vec<f64>| {
                    row[c * across..].iter().take(across).copied().fold(f64::NAN, |a, b| larger(a, &b))
                };
                rows.iter().map(in_row).fold(f64::NAN, |a, b| larger(a, &b))
            };
            (0..columns).map(cell).collect()
        })
        .collect()
}
