//! The demo in words: what was done, and the paper's three tables beside what is measured.

use std::fmt::{self, Display, Formatter};

use super::{Demo, NOISE_NM};
use crate::fit::paper;
use crate::number::{number, plus_minus};
use crate::text_table::Head::{Numbers, Words};
use crate::text_table::text_table;

impl Display for Demo {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "Recording: {}, {} rows, three quasi-static cycles to ±1.168 mrad, torque noise {NOISE_NM} N·m.\n",
            self.built_in.recording.name,
            self.built_in.recording.len()
        )?;
        writeln!(f, "Torque error, rms in N·m")?;
        let rows = self.left.iter().map(|left| {
            [left.model.to_string(), format!("{:.4}", left.recorded_rms_nm), format!("{:.4}", left.noise_free_rms_nm)]
        });
        let heads = [Words(""), Numbers("against the recording"), Numbers("against the torque without its noise")];
        f.write_str(&text_table(heads, rows))?;
        self.table_1(f)?;
        self.table_2(f)?;
        self.table_3(f)
    }
}

impl Demo {
    fn table_1(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nTable 1 of the paper (the rows that are known), torque in N·m")?;
        let rows = self.table_1.iter().map(|(published, identified)| {
            [
                if published.loading { "loading" } else { "unloading" }.to_owned(),
                format!("{:.3}", published.deflection_rad * 1e3),
                format!("{:.1}", published.measured_nm),
                format!("{:.2}", published.cycle_nm),
                format!("{:.2}", published.remanence_nm),
                format!("{:.2}", identified.cycle_nm),
                format!("{:.2}", identified.remanence_nm),
            ]
        });
        let [angle, measured, published, of_published, identified, of_identified] = [
            "θ in mrad",
            "measured by the paper",
            "published: cycle",
            "from remanence",
            "identified: cycle",
            "from remanence",
        ]
        .map(Numbers);
        let heads = [Words("branch"), angle, measured, published, of_published, identified, of_identified];
        f.write_str(&text_table(heads, rows))?;
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
        let rows = published.into_iter().filter_map(|(name, value)| {
            let found = self.fit.parameter(name)?;
            let identified = found.sd.map_or("not determined".to_owned(), |sd| plus_minus(found.value, sd));
            Some([name.to_owned(), number(value, 5), identified, found.unit.to_string()])
        });
        let heads = [Words("parameter"), Numbers("published"), Words("identified ± standard deviation"), Words("unit")];
        write!(f, "\nTable 2 of the paper\n{}", text_table(heads, rows))?;
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
            "  At 64 points, Table 1's steps of 2 N·m, that is about 9 times {gmhm}. A ratio of {:.0} takes some 1600",
            lines / gmhm
        )?;
        writeln!(f, "  to 1860 points, which the paper does not mention.")
    }
}
