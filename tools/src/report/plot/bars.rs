//! One number a name.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{AXIS, Canvas, Drawing, GRID, HEIGHT, Role, SHARPNESS, WORDS, anchored, drawing_of, font, head, px};
use crate::number::{number, tick};

/// One number a name, as horizontal bars from zero.
#[derive(Debug, Clone, Default)]
pub struct Bars {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Names and numbers from top to bottom; numbers that are not finite have no bar. The first one stands out.
    pub bars: Vec<(String, f64)>,
}

/// Height of the title and the axis, and of a name over its bar, pixels.
const HEAD_AND_AXIS: u32 = 108;
const LINE: u32 = 38;

impl Bars {
    /// The bars drawn.
    pub fn draw(&self) -> Drawing {
        let height = HEIGHT.max(HEAD_AND_AXIS + LINE * self.bars.len() as u32);
        drawing_of(height, &self.title, |canvas| self.draw_on(canvas).map_err(|e| e.to_string()))
    }

    fn draw_on<'a>(&self, canvas: &Canvas<'a>) -> super::Drawn<'a> {
        let count = self.bars.len();
        let longest = self.bars.iter().map(|bar| bar.1).filter(|length| length.is_finite()).fold(0.0, f64::max);
        head(canvas, &self.title)?;
        let (_, below) = canvas.split_vertically(px(48));
        let end = if longest > 0.0 { 1.05 * longest } else { 1.0 };
        let x_tick = |v: &f64| tick(*v, end);
        let mut chart = ChartBuilder::on(&below)
            .margin_left(px(30))
            .margin_right(px(24))
            .margin_bottom(px(10))
            .x_label_area_size(px(50))
            .build_cartesian_2d(0.0..end, 0.0..count.max(1) as f64)?;
        chart
            .configure_mesh()
            .disable_y_axis()
            .disable_y_mesh()
            .x_desc(&self.x_label)
            .x_label_formatter(&x_tick)
            .label_style(font(WORDS))
            .axis_desc_style(font(AXIS))
            .axis_style(BLACK.stroke_width(SHARPNESS))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(SHARPNESS))
            .draw()?;
        for (place, (name, length)) in self.bars.iter().rev().enumerate() {
            let role = if place + 1 == count { Role::Model } else { Role::Measured };
            let words = if length.is_finite() {
                format!("{name}\u{2003}{}", number(*length, 4))
            } else {
                format!("{name}\u{2003}–")
            };
            let (low, high) = (place as f64 + 0.1, place as f64 + 0.45);
            if length.is_finite() {
                chart.draw_series([Rectangle::new([(0.0, low), (*length, high)], role.colour().filled())])?;
            }
            let at = (0.005 * longest, place as f64 + 0.5);
            chart.draw_series([Text::new(words, at, anchored(WORDS, HPos::Left, VPos::Bottom))])?;
        }
        Ok(())
    }
}
