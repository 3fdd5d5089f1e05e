//! What people use in place of a hysteresis model: a linear spring, and two lines, one a direction.

/// A straight line, torque over deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Its slope, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Its torque at zero deflection, N·m.
    pub offset_nm: f64,
}

impl Line {
    /// The least-squares line through points (deflection, torque).
    pub fn fit(points: impl Iterator<Item = (f64, f64)> + Clone) -> Line {
        let n = points.clone().count().max(1) as f64;
        let (sx, sy) = points.clone().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x, sy + y));
        let (mx, my) = (sx / n, sy / n);
        let (xx, xy) = points.fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - mx).powi(2), xy + (x - mx) * (y - my)));
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        Line { stiffness_nm_per_rad: slope, offset_nm: my - slope * mx }
    }

    /// The torque at a deflection.
    pub fn torque_nm(&self, deflection_rad: f64) -> f64 {
        self.offset_nm + self.stiffness_nm_per_rad * deflection_rad
    }
}

/// The linear spring's torque for every row.
pub fn linear_spring(deflection_rad: &[f64], torque_nm: &[f64]) -> Vec<f64> {
    let line = Line::fit(deflection_rad.iter().copied().zip(torque_nm.iter().copied()));
    deflection_rad.iter().map(|x| line.torque_nm(*x)).collect()
}

/// Two lines' torque for every row: one for rising deflection, one for falling.
pub fn two_lines(deflection_rad: &[f64], torque_nm: &[f64]) -> Vec<f64> {
    let rising: Vec<bool> = (0..deflection_rad.len())
        .map(|k| {
            let (before, after) = if k == 0 { (0, 1.min(deflection_rad.len() - 1)) } else { (k - 1, k) };
            deflection_rad[after] >= deflection_rad[before]
        })
        .collect();
    let points = deflection_rad.iter().copied().zip(torque_nm.iter().copied()).zip(rising.iter().copied());
    let line = |up: bool| Line::fit(points.clone().filter(move |(_, r)| *r == up).map(|(point, _)| point));
    let lines = [line(false), line(true)];
    deflection_rad.iter().zip(&rising).map(|(x, up)| lines[usize::from(*up)].torque_nm(*x)).collect()
}

/// Residual sum of squares, in the square of the torque's unit.
pub fn rss(measured: &[f64], model: &[f64]) -> f64 {
    measured.iter().zip(model).map(|(a, b)| (a - b).powi(2)).sum()
}

/// Root mean square of the residual, in the torque's unit.
pub fn rms(measured: &[f64], model: &[f64]) -> f64 {
    (rss(measured, model) / measured.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::paper;
    use super::*;

    #[test]
    fn two_lines_on_the_published_cycle_leave_what_model_md_says() {
        let params = paper::published().unwrap();
        for points in [64, 2000] {
            let (x, y) = paper::steady_cycle(&params, points);
            let share = rss(&y, &two_lines(&x, &y)) / points as f64;
            // MODEL.md section 2, finding 7: 2.4 to 2.8 N²m² a point, by spacing.
            assert!((2.3..2.9).contains(&share), "{points} points: {share}");
        }
    }

    #[test]
    fn a_line_is_found_exactly() {
        let line = Line::fit([(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)].into_iter());
        assert_eq!((line.stiffness_nm_per_rad, line.offset_nm), (2.0, 1.0));
    }
}
