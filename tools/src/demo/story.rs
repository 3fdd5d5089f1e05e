//! The demo in words: what was done, and the paper's three tables beside what is measured.

use std::fmt::{self, Display, Formatter};

use super::{Demo, NOISE_NM};
use crate::fit::paper;
use crate::number::{number, plus_minus};

impl Display for Demo {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "Recording: {}, {} rows, three quasi-static cycles to ±1.168 mrad, torque noise {NOISE_NM} N·m.\n",
            self.built_in.recording.name,
            self.built_in.recording.len()
        )?;
        writeln!(f, "Torque error, rms in N·m         against the recording   against the torque without its noise")?;
        for left in &self.left {
            writeln!(f, "  {:<30} {:>10.4} {:>25.4}", left.model, left.recorded_rms_nm, left.noise_free_rms_nm)?;
        }
        self.table_1(f)?;
        self.table_2(f)?;
        self.table_3(f)
    }
}

impl Demo {
    fn table_1(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nTable 1 of the paper (the rows that are known), torque in N·m")?;
        writeln!(f, "                        measured   published parameters        identified here")?;
        writeln!(f, "  branch      θ in mrad by the paper  cycle  from remanence    cycle  from remanence")?;
        for (published, identified) in &self.table_1 {
            writeln!(
                f,
                "  {:<10} {:>9.3} {:>12.1} {:>7.2} {:>15.2} {:>8.2} {:>15.2}",
                if published.loading { "loading" } else { "unloading" },
                published.deflection_rad * 1e3,
                published.measured_nm,
                published.cycle_nm,
                published.remanence_nm,
                identified.cycle_nm,
                identified.remanence_nm,
            )?;
        }
        writeln!(
            f,
            "  The unloading rows agree. The loading rows lie on no closed cycle of these parameters: they are"
        )?;
        writeln!(f, "  a re-loading from remanence (0.143 mrad), where the turning-point law comes near them.")
    }

    fn table_2(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (elastic, memory) = paper::table_2();
        let published = [
            ("c1_nm_per_rad", elastic.c1_nm_per_rad),
            ("c2_nm_per_rad3", elastic.c2_nm_per_rad3),
            ("c3_nm_per_rad5", elastic.c3_nm_per_rad5),
            ("e", memory.e().abs()),
            ("h", memory.h().abs()),
            ("rho", memory.rho()),
        ];
        writeln!(f, "\nTable 2 of the paper       published    identified ± standard deviation")?;
        for (name, value) in published {
            let Some(found) = self.fit.parameter(name) else { continue };
            let identified = found.sd.map_or("not determined".to_owned(), |sd| plus_minus(found.value, sd));
            writeln!(f, "  {name:<18} {:>15}    {identified} {}", number(value, 5), found.unit)?;
        }
        writeln!(f, "  Of α, β and ω the loop fixes only e = αβ/(β²+ω²), h = αω/(β²+ω²) and ρ = β/ω: the three alone")?;
        writeln!(f, "  have no standard error.")
    }

    fn table_3(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (gmhm, lines) = paper::TABLE_3;
        writeln!(
            f,
            "\nTable 3 of the paper: residual sum of squares {gmhm} N²m² against {lines} for two lines, {:.0} times.",
            lines / gmhm
        )?;
        for measured in &self.table_3 {
            writeln!(
                f,
                "  Measured: two lines fitted to the published cycle leave {:.0} N²m² at {} points ({:.2} a point).",
                measured.rss,
                measured.points,
                measured.rss / measured.points as f64,
            )?;
        }
        writeln!(
            f,
            "  At 64 points, Table 1's steps of 2 N·m, that is about 9 times {gmhm}. A ratio of {:.0} takes some 1,600",
            lines / gmhm
        )?;
        writeln!(f, "  to 1,860 points, which the paper does not mention.")
    }
}
