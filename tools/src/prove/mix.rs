//! Which cases make up a proof.

mod loud;

use super::generator::{CaseSpec, Colour, FRICTION, KINDS, OUTSIDE, PlantKind, Rng, case_seed, fits_a_joint};

/// Blocks of the proof, in the order of the table.
pub const BLOCKS: [&str; 10] = [
    "null",
    "single 0.15",
    "single 0.05",
    "pair",
    "open world",
    "maxwell slip",
    "left out",
    "real noise",
    "simulation",
    "loud",
];

/// The first of [`BLOCKS`] whose effects are loud.
const FIRST_LOUD: usize = 8;
/// Cases of the loud blocks are numbered from here on, so that the others keep their numbers.
const LOUD_FROM: usize = 100_000;
/// One case in so many is of a loud block, where both are wanted.
const ONE_LOUD_IN: usize = 5;

/// One round of thirty cases, as indices into [`BLOCKS`]: ten nulls, and every block early, so that a short run reads like a long one.
const ROUND: [usize; 30] = [0, 1, 2, 3, 0, 4, 1, 0, 2, 6, 0, 1, 2, 3, 0, 5, 4, 0, 1, 2, 0, 7, 0, 6, 1, 0, 3, 2, 4, 0];

/// The cases of a proof with their numbers. Case `n` is the same whatever the length of the run. Cases that need real noise
/// are left out where `real` is empty. The loud ones come last.
pub fn suite(seed: u64, cases: usize, real: &[Vec<f64>]) -> Vec<(usize, CaseSpec)> {
    only(&BLOCKS, seed, cases, real)
}

/// The first `cases` cases of some of [`BLOCKS`], with the numbers that they have among all. Cases that need real noise are
/// left out where `real` is empty.
pub fn only(blocks: &[&str], seed: u64, cases: usize, real: &[Vec<f64>]) -> Vec<(usize, CaseSpec)> {
    let loud_kinds = BLOCKS.len() - FIRST_LOUD;
    let loud = blocks.iter().filter(|b| BLOCKS[FIRST_LOUD..].contains(b)).count();
    let loud_cases = match (loud, blocks.len() - loud) {
        (0, _) => 0,
        (_, 0) => cases,
        _ => cases / ONE_LOUD_IN,
    };
    let of = |index: &usize| blocks.contains(&BLOCKS[block(*index)]);
    let quiet = (0..cases * ROUND.len()).filter(of).take(cases - loud_cases);
    let loud = (LOUD_FROM..LOUD_FROM + cases * loud_kinds).filter(of).take(loud_cases);
    quiet.chain(loud).filter_map(|index| Some((index, spec(seed, index, real)?))).collect()
}

/// The block of case `index`, as an index into [`BLOCKS`].
fn block(index: usize) -> usize {
    match index.checked_sub(LOUD_FROM) {
        Some(number) => FIRST_LOUD + number % (BLOCKS.len() - FIRST_LOUD),
        None => ROUND[index % ROUND.len()],
    }
}

fn spec(seed: u64, index: usize, real: &[Vec<f64>]) -> Option<CaseSpec> {
    if let Some(number) = index.checked_sub(LOUD_FROM) {
        let count = number / (BLOCKS.len() - FIRST_LOUD);
        return Some(loud::spec(BLOCKS[block(index)], count, &mut Rng::new(case_seed(seed, index as u64)).stream(50)));
    }
    let block = block(index);
    let per_round = ROUND.iter().filter(|b| **b == block).count();
    let before = ROUND[..index % ROUND.len()].iter().filter(|b| **b == block).count();
    let count = index / ROUND.len() * per_round + before;
    let mut rng = Rng::new(case_seed(seed, index as u64)).stream(50);
    // Steps coprime to the number of kinds: every kind comes in turn.
    let kind = KINDS[(count * 5 + seed as usize % KINDS.len()) % KINDS.len()];
    let joint = |rng: &mut Rng, kind: &str| fits_a_joint(kind) && rng.chance(0.35);
    let mut spec = CaseSpec {
        block: BLOCKS[block].to_owned(),
        plant_model: PlantKind::Gmhm,
        effects: Vec::new(),
        colour: Colour::Any,
        removed: Vec::new(),
        real: None,
        loud: false,
    };
    let mut hide = |kind: &str, size_nm: f64| spec.effects.push((kind.to_owned(), size_nm));
    match BLOCKS[block] {
        "null" => {
            spec.colour = Colour::Coloured;
            if rng.chance(0.2) {
                spec.plant_model = PlantKind::Joint;
            }
        }
        "pair" => {
            hide(kind, 0.15);
            // Friction that warms up is that of the base model here, of every friction in the library: no other friction is hidden beside it.
            let clash = |a: &str, b: &str| a == "thermal_friction" && FRICTION.contains(&b);
            let others: Vec<&str> =
                KINDS.into_iter().filter(|k| *k != kind && !clash(k, kind) && !clash(kind, k)).collect();
            hide(rng.pick(&others), 0.15);
        }
        "open world" => {
            let kind = OUTSIDE[count % OUTSIDE.len()];
            hide(kind, 0.15);
            if joint(&mut rng, kind) {
                spec.plant_model = PlantKind::Joint;
            }
        }
        "maxwell slip" => {
            // Slip elements beside those of the gear are no effect of their own.
            let others: Vec<&str> = KINDS.into_iter().filter(|k| *k != "nonlocal_memory").collect();
            hide(if others.contains(&kind) { kind } else { rng.pick(&others) }, 0.15);
            spec.plant_model = PlantKind::Maxwell;
        }
        "left out" => {
            hide(kind, 0.15);
            spec.removed = vec![kind.to_owned()];
        }
        "real noise" => {
            hide(kind, 0.15);
            spec.real = Some(real.get(count % real.len().max(1))?.clone());
        }
        name => {
            hide(kind, if name == "single 0.15" { 0.15 } else { 0.05 });
            if joint(&mut rng, kind) {
                spec.plant_model = PlantKind::Joint;
            }
        }
    }
    Some(spec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_run_has_500_coloured_nulls_and_every_kind() {
        let specs = suite(1, super::super::FULL_CASES, &[vec![0.0]]);
        let nulls: Vec<_> = specs.iter().filter(|(_, s)| s.block == "null").collect();
        assert!(nulls.len() >= 500 && nulls.iter().all(|(_, s)| s.colour == Colour::Coloured));
        for block in ["single 0.15", "single 0.05", "left out"] {
            for kind in KINDS {
                assert!(specs.iter().any(|(_, s)| s.block == block && s.effects[0].0 == kind), "{kind} in {block}");
            }
        }
        assert_eq!(suite(1, 60, &[]).len(), 59);
        assert_eq!(suite(1, 60, &[vec![0.0]]).iter().filter(|(index, _)| *index >= LOUD_FROM).count(), 12);
    }

    #[test]
    fn a_block_alone_holds_the_cases_that_it_has_among_all() {
        let all = suite(9, 112, &[]);
        let left_out: Vec<_> = all.iter().filter(|(_, spec)| spec.block == "left out").cloned().collect();
        assert_eq!(only(&["left out"], 9, left_out.len(), &[]), left_out);
        // Every kind is left out once in as many cases as there are kinds.
        let mut kinds: Vec<_> = only(&["left out"], 9, 22, &[]).into_iter().map(|(_, spec)| spec.removed).collect();
        kinds.sort();
        kinds.dedup();
        assert_eq!(kinds.len(), 22);
        assert_eq!(only(&["null"], 9, 500, &[]).len(), 500);
        assert!(only(&["real noise"], 9, 5, &[]).is_empty());
    }
}
