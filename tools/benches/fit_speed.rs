//! How long a fit takes and what it allocates: `cargo bench -p gmhm-tools --bench fit_speed`.
//!
//! Published gear, σ = 0.1 N·m, uncertainty included. `given` keeps law masing, `chosen` tries every structure. Best of several runs.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use gmhm_tools::estimate::{FitOptions, fit};
use gmhm_tools::model::Model;

#[path = "../tests/gears/mod.rs"]
mod gears;

use gears::{Path, cycle, published, record};

const A: f64 = 1.168e-3;

fn main() {
    let (elastic, memory) = published();
    let mut start = Model { elastic: Some(elastic), memory: Some(memory), ..Model::default() };
    start.gear.rated_deflection_rad = Some(A);
    let given = FitOptions { start: Some(start), ..FitOptions::default() };
    let chosen = FitOptions { rated_deflection_rad: Some(A), ..FitOptions::default() };
    println!("{:>10} {:>8} {:>12} {:>12} {:>12}", "rows", "method", "time", "ns a row", "bytes a row");
    for (rows, cycles, runs) in [(64, 1.0, 20), (2000, 1.0, 10), (100_000, 20.0, 3), (1_000_000, 200.0, 2)] {
        let recording = record(A, elastic, memory, &Path { theta: cycle(A, rows, cycles), period_s: 1e-3 }, 0.1, 1);
        for (name, options) in [("given", &given), ("chosen", &chosen)] {
            let mut best = f64::INFINITY;
            let before = CURRENT.load(Ordering::Relaxed);
            PEAK.store(before, Ordering::Relaxed);
            for _ in 0..runs {
                let clock = Instant::now();
                let found = fit(std::slice::from_ref(&recording), options, &());
                best = best.min(clock.elapsed().as_secs_f64());
                assert!(found.is_ok_and(|f| (f.rms - 0.1).abs() < 0.03));
            }
            // The recording itself: time, deflection, torque.
            let bytes = (PEAK.load(Ordering::Relaxed) - before) as f64 / rows as f64 + 24.0;
            println!("{rows:>10} {name:>8} {:>9.2} ms {:>12.0} {bytes:>12.0}", 1e3 * best, 1e9 * best / rows as f64);
        }
    }
}

/// The system's allocator with a count of live bytes.
struct Counting;

static CURRENT: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[allow(unsafe_code)]
// SAFETY: every call is handed on unchanged to the system's allocator; only a counter is kept beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = CURRENT.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        CURRENT.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}
