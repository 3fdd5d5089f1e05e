//! Which cases make up a proof.

mod loud;

use super::generator::{CaseSpec, Colour, FRICTION, KINDS, OUTSIDE, PlantKind, Rng, case_seed, fits_a_joint};

/// Blocks of the proof, in the order of the table.
pub const BLOCKS: [&str; 11] = [
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
    "pair left out",
];

/// Those of a run for which none is chosen.
pub const SUITE: &[&str] = BLOCKS.split_at(PAIR_LEFT_OUT).0;

/// The last of [`BLOCKS`]: one of two kinds is not in the library.
const PAIR_LEFT_OUT: usize = 10;
/// Its cases are numbered from here on.
const PAIR_LEFT_OUT_FROM: usize = 200_000;

/// The first of [`BLOCKS`] whose effects are loud.
const FIRST_LOUD: usize = 8;
/// Cases of the loud blocks are numbered from here on, so that the others keep their numbers.
const LOUD_FROM: usize = 100_000;
/// Blocks with loud effects.
const LOUD_KINDS: usize = PAIR_LEFT_OUT - FIRST_LOUD;
/// One case in so many is of a loud block, and one of the block with one of two kinds left out, where others are wanted, too.
const ONE_APART_IN: usize = 5;

/// One round of thirty cases, as indices into [`BLOCKS`]: ten nulls, and every block early, so that a short run reads like a long one.
const ROUND: [usize; 30] = [0, 1, 2, 3, 0, 4, 1, 0, 2, 6, 0, 1, 2, 3, 0, 5, 4, 0, 1, 2, 0, 7, 0, 6, 1, 0, 3, 2, 4, 0];

/// The cases of a proof with their numbers. Case `n` is the same whatever the length of the run. Cases that need real noise
/// are left out where `real` is empty. The loud ones come last.
pub fn suite(seed: u64, cases: usize, real: &[Vec<f64>]) -> Vec<(usize, CaseSpec)> {
    only(SUITE, seed, cases, real)
}

/// The first `cases` cases of some of [`BLOCKS`], with the numbers that they have among all. Cases that need real noise are
/// left out where `real` is empty.
pub fn only(blocks: &[&str], seed: u64, cases: usize, real: &[Vec<f64>]) -> Vec<(usize, CaseSpec)> {
    let count = |from: usize, to: usize| blocks.iter().filter(|b| BLOCKS[from..to].contains(b)).count();
    let (quiet, loud) = (count(0, FIRST_LOUD), count(FIRST_LOUD, PAIR_LEFT_OUT));
    let part = |of: usize, others: usize, most: usize| match (of, others) {
        (0, _) => 0,
        (_, 0) => most,
        _ => cases / ONE_APART_IN,
    };
    let left_out = part(count(PAIR_LEFT_OUT, BLOCKS.len()), quiet + loud, cases);
    let loud = part(loud, quiet, cases - left_out);
    let of = |index: &usize| blocks.contains(&BLOCKS[block(*index)]);
    let quiet = (0..cases * ROUND.len()).filter(of).take(cases - loud - left_out);
    let loud = (LOUD_FROM..LOUD_FROM + cases * LOUD_KINDS).filter(of).take(loud);
    let left_out = (PAIR_LEFT_OUT_FROM..).take(left_out);
    quiet.chain(loud).chain(left_out).filter_map(|index| Some((index, spec(seed, index, real)?))).collect()
}

/// The block of case `index`, as an index into [`BLOCKS`].
fn block(index: usize) -> usize {
    match index {
        PAIR_LEFT_OUT_FROM.. => PAIR_LEFT_OUT,
        LOUD_FROM.. => FIRST_LOUD + (index - LOUD_FROM) % LOUD_KINDS,
        _ => ROUND[index % ROUND.len()],
    }
}

/// Which case of its block case `index` is, from 0.
fn count(index: usize) -> usize {
    match index {
        PAIR_LEFT_OUT_FROM.. => index - PAIR_LEFT_OUT_FROM,
        LOUD_FROM.. => (index - LOUD_FROM) / LOUD_KINDS,
        _ => {
            let of_block = |rounds: &[usize]| rounds.iter().filter(|b| **b == block(index)).count();
            index / ROUND.len() * of_block(&ROUND) + of_block(&ROUND[..index % ROUND.len()])
        }
    }
}

fn spec(seed: u64, index: usize, real: &[Vec<f64>]) -> Option<CaseSpec> {
    let (block, count) = (block(index), count(index));
    if (FIRST_LOUD..PAIR_LEFT_OUT).contains(&block) {
        return Some(loud::spec(BLOCKS[block], count, &mut Rng::new(case_seed(seed, index as u64)).stream(50)));
    }
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
        "pair" | "pair left out" => {
            hide(kind, 0.15);
            // Friction that warms up is that of the base model here, of every friction in the library: no other friction is hidden beside it.
            let clash = |a: &str, b: &str| a == "thermal_friction" && FRICTION.contains(&b);
            let others: Vec<&str> =
                KINDS.into_iter().filter(|k| *k != kind && !clash(k, kind) && !clash(kind, k)).collect();
            hide(rng.pick(&others), 0.15);
            if block == PAIR_LEFT_OUT {
                spec.removed = vec![kind.to_owned()];
            }
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
    fn a_pair_with_a_kind_left_out_is_made_where_it_is_chosen() {
        assert!(suite(9, 200, &[]).iter().all(|(_, spec)| spec.block != "pair left out"));
        let alone = only(&["pair left out"], 9, 40, &[]);
        assert!(alone.iter().all(|(_, s)| s.effects.len() == 2 && s.removed == [s.effects[0].0.clone()]));
        let beside = only(&["pair", "loud", "pair left out"], 9, 40, &[]);
        assert_eq!(beside.len(), 40);
        assert_eq!(beside[32..], alone[..8]);
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
