//! Fewer points that look the same.

use std::collections::HashSet;
use std::ops::Range;

/// Buckets that a long curve over an increasing coordinate is cut into; each keeps its ends and its extremes.
const BUCKETS: usize = 400;
/// Points that are drawn as they are.
const FEW: usize = 4 * BUCKETS;
/// Points of a path that turns back; a break counts as ten.
const MOST_INK: usize = 5000;
/// Dots of a cloud.
const MOST_DOTS: usize = 1500;
/// Cells of the figure that count as one place, in pixels.
const CELLS: [f64; 9] = [1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0];

/// Where the points are drawn.
pub struct Window {
    pub x: Range<f64>,
    pub y: Range<f64>,
    pub pixels: (f64, f64),
}

impl Window {
    fn cell(&self, point: (f64, f64), size: f64) -> (i64, i64) {
        let at = |v: f64, range: &Range<f64>, pixels: f64| {
            ((v - range.start) / (range.end - range.start) * pixels / size).floor() as i64
        };
        (at(point.0, &self.x, self.pixels.0), at(point.1, &self.y, self.pixels.1))
    }
}

fn is_finite(point: &(f64, f64)) -> bool {
    point.0.is_finite() && point.1.is_finite()
}

pub fn finite(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().copied().filter(is_finite).collect()
}

/// A cloud without the dots that would fall on others.
pub fn dots(points: &[(f64, f64)], window: &Window) -> Vec<(f64, f64)> {
    if points.len() <= FEW {
        return points.to_vec();
    }
    let mut kept = Vec::new();
    for size in CELLS {
        let mut inked = HashSet::new();
        kept = points.iter().copied().filter(|p| inked.insert(window.cell(*p, size))).collect();
        if kept.len() <= MOST_DOTS {
            break;
        }
    }
    kept
}

/// A line in pieces; it breaks at points that are not finite. Over an increasing coordinate no peak is lost; of a path that turns back only what falls on ink
/// already drawn is.
pub fn line(points: &[(f64, f64)], window: &Window) -> Vec<Vec<(f64, f64)>> {
    let runs: Vec<&[(f64, f64)]> = points.split(|p| !is_finite(p)).filter(|run| !run.is_empty()).collect();
    let count: usize = runs.iter().map(|run| run.len()).sum();
    if count <= FEW {
        return runs.into_iter().map(<[_]>::to_vec).collect();
    }
    if runs.iter().all(|run| run.windows(2).all(|w| w[0].0 <= w[1].0)) {
        // Of runs of different rates each has the buckets of its share of the axis.
        let span = |run: &[(f64, f64)]| run[run.len() - 1].0 - run[0].0;
        let whole: f64 = runs.iter().map(|run| span(run)).sum();
        let bucket = |run: &[(f64, f64)]| {
            let buckets = (BUCKETS as f64 * span(run) / whole.max(f64::MIN_POSITIVE)).ceil().max(1.0);
            (run.len() as f64 / buckets).ceil() as usize
        };
        return runs.into_iter().map(|run| extremes(run, bucket(run))).collect();
    }
    let mut pieces = Vec::new();
    for size in CELLS {
        pieces = ink(&runs, window, size);
        if pieces.iter().map(|piece| piece.len() + 10).sum::<usize>() <= MOST_INK {
            break;
        }
    }
    pieces
}

/// Of a long spectrum the highest line of each bucket.
pub fn highest(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    const MOST: usize = 400;
    let bucket = points.len().div_ceil(MOST).max(1);
    points.chunks(bucket).filter_map(|b| b.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))).collect()
}

fn extremes(points: &[(f64, f64)], bucket: usize) -> Vec<(f64, f64)> {
    let mut kept = Vec::with_capacity(FEW);
    for bucket in points.chunks(bucket) {
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

/// The pen goes up where the path runs over ink and comes down before it leaves it.
fn ink(runs: &[&[(f64, f64)]], window: &Window, size: f64) -> Vec<Vec<(f64, f64)>> {
    let mut inked = HashSet::new();
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    for run in runs {
        let mut at = window.cell(run[0], size);
        let mut pen_down = inked.insert(at);
        if pen_down {
            pieces.push(vec![run[0]]);
        }
        for pair in run.windows(2) {
            let cell = window.cell(pair[1], size);
            if cell == at {
                continue;
            }
            at = cell;
            let fresh = inked.insert(cell);
            if fresh && !pen_down {
                pieces.push(vec![pair[0]]);
            }
            if (fresh || pen_down)
                && let Some(piece) = pieces.last_mut()
            {
                piece.push(pair[1]);
            }
            pen_down = fresh;
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loops(rows: usize) -> Vec<(f64, f64)> {
        let phase = |k: usize| std::f64::consts::TAU * k as f64 / 5000.0;
        (0..rows).map(|k| (phase(k).sin(), phase(k).sin() + 0.2 * phase(k).cos())).collect()
    }

    fn window() -> Window {
        Window { x: -1.1..1.1, y: -1.3..1.3, pixels: (760.0, 420.0) }
    }

    #[test]
    fn a_loop_run_a_thousand_times_looks_like_one_run() {
        let many = line(&loops(5_000_000), &window());
        let drawn: usize = many.iter().map(Vec::len).sum();
        assert!(drawn < 3000, "{drawn} points");
        // Every place of the loop is near a line drawn.
        let near = |p: (f64, f64)| many.iter().flatten().any(|q| (p.0 - q.0).abs() < 0.02 && (p.1 - q.1).abs() < 0.03);
        assert!(loops(5000).into_iter().step_by(50).all(near));
        let jump = |piece: &Vec<(f64, f64)>| piece.windows(2).any(|w| (w[0].0 - w[1].0).hypot(w[0].1 - w[1].1) > 0.1);
        assert!(!many.iter().any(jump), "a line across the loop");
    }

    #[test]
    fn a_peak_in_time_survives() {
        let mut points: Vec<(f64, f64)> = (0..1_000_000).map(|k| (k as f64, 0.0)).collect();
        points[654_321].1 = 5.0;
        let kept = line(&points, &window());
        assert!(kept[0].len() <= FEW && kept[0].contains(&(654_321.0, 5.0)));
    }

    #[test]
    fn a_short_run_of_few_rows_beside_a_long_one_is_drawn_whole() {
        let slow: Vec<(f64, f64)> = (0..64).map(|k| (0.1 * f64::from(k), f64::from(k % 7))).collect();
        let fast = (0..200_000).map(|k| (7.0 + 2e-4 * f64::from(k), f64::from(k % 5)));
        let both: Vec<(f64, f64)> = slow.iter().copied().chain([(f64::NAN, f64::NAN)]).chain(fast).collect();
        let kept = line(&both, &window());
        assert_eq!(kept[0], slow);
        assert!(kept[1].len() <= FEW, "{}", kept[1].len());
    }

    #[test]
    fn a_line_breaks_at_what_is_not_finite_however_long_it_is() {
        for rows in [10, 200_000] {
            let along: Vec<(f64, f64)> = (0..rows).map(|k| (k as f64, 0.0)).collect();
            for part in [along, loops(rows)] {
                let later = part.iter().map(|p| (p.0 + 0.3, p.1 + 5.0));
                let both: Vec<(f64, f64)> = part.iter().copied().chain([(f64::NAN, f64::NAN)]).chain(later).collect();
                let pieces = line(&both, &window());
                let crosses = |piece: &Vec<(f64, f64)>| piece.windows(2).any(|w| (w[0].1 - w[1].1).abs() > 3.0);
                assert!(pieces.len() > 1 && !pieces.iter().any(crosses), "{rows} rows");
            }
        }
    }

    #[test]
    fn a_cloud_is_bounded_and_keeps_its_outline() {
        let cloud: Vec<(f64, f64)> =
            (0..200_000).map(|k| ((k as f64 * 0.618).fract(), (k as f64 * 0.414).fract())).collect();
        let kept = dots(&cloud, &Window { x: 0.0..1.0, y: 0.0..1.0, pixels: (760.0, 420.0) });
        assert!(kept.len() <= MOST_DOTS, "{}", kept.len());
        assert!(kept.iter().any(|p| p.0 < 0.04) && kept.iter().any(|p| p.0 > 0.96));
    }
}
