//! What else a drive could compute: the paper's closed form, and the customary models of hysteresis.

use gmhm::closed_form::ClosedForm;
use gmhm::{Gate, Kernel, Law};

use crate::platform::gears::{self, RATED_RAD};
use crate::{report, say};

/// Measures every rival.
pub fn measure() {
    let Ok(params) = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0) else {
        return say!("0 1 parameters refused");
    };
    let path: [f32; 500] = core::array::from_fn(|k| RATED_RAD * 0.99 * (k as f32 / 250.0 - 1.0));
    let closed = ClosedForm::<f32>::new(&params);
    report("closed form of the paper, `libm`", &path, |theta| closed_form(&closed, theta));
}

#[inline(never)]
fn closed_form(form: &ClosedForm<f32>, theta: f32) -> f32 {
    form.torque_on_branch(theta, 2)
}
