//! Coefficients of pairs: case C20, mixing rules and tables of named materials.

use crate::harness::*;
use carom::{BodySpec, MaterialPair, Mixing, Settings, World};

in_plane_and_space!(
    each_mixing_rule_gives_its_mean_at_a_contact,
    a_pair_of_materials_overrides_the_mix_in_either_order,
    what_a_pair_leaves_out_is_mixed,
    pairs_are_part_of_a_snapshot,
    impossible_pairs_are_refused_by_name,
);

/// A ball on a floor of other coefficients and materials.
fn scene<S: Dimension>(settings: Settings<S>) -> World<S> {
    let mut w = world::<S>(settings);
    let floor = BodySpec::fixed(S::floor()).friction(0.9).restitution(0.2).resisting(0.01, 0.02);
    add(&mut w, "floor", floor.material("ice"));
    let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.0, 0.1)).friction(0.4).restitution(0.8);
    add(&mut w, "ball", ball.material("steel"));
    w
}

/// Case C20.
pub fn each_mixing_rule_gives_its_mean_at_a_contact<S: Dimension>() {
    for rule in Mixing::ALL {
        let wanted = |a: f64, b: f64| match rule {
            Mixing::Min => a.min(b),
            Mixing::Max => a.max(b),
            Mixing::Mean => 0.5 * (a + b),
            Mixing::Product => a * b,
            Mixing::Geometric => (a * b).sqrt(),
            Mixing::Harmonic => 2.0 * a * b / (a + b),
        };
        let mut w = scene::<S>(Settings { friction_mixing: rule, restitution_mixing: rule, ..exact(1e-3) });
        step(&mut w);
        let touch = w.touches()[0];
        close(touch.friction, wanted(0.9, 0.4), 1e-16, &format!("C20 friction, {}", rule.name()));
        close(touch.restitution, wanted(0.2, 0.8), 1e-16, &format!("C20 restitution, {}", rule.name()));
    }
}

/// All five coefficients, said in either order of the names.
pub fn a_pair_of_materials_overrides_the_mix_in_either_order<S: Dimension>() {
    let pair = MaterialPair {
        friction: Some(0.02),
        restitution: Some(0.05),
        tangential_restitution: Some(0.7),
        rolling_friction: Some(0.001),
        spinning_friction: Some(0.0),
    };
    for (one, other) in [("steel", "ice"), ("ice", "steel")] {
        let mut w = scene::<S>(exact(1e-3));
        w.set_pair(one, other, pair).expect("both are known");
        step(&mut w);
        let t = w.touches()[0];
        assert_eq!((t.friction, t.restitution, t.rolling, t.spinning), (0.02, 0.05, 0.001, 0.0));
        assert_eq!(t.tangential_restitution, 0.7);
        assert!(w.remove_pair(other, one).expect("both are known"), "it was there");
        step(&mut w);
        close(w.touches()[0].friction, 0.6, 1e-15, "mixed again");
    }
}

/// A pair may say one coefficient alone; bodies of one material are a pair too, and bodies of none never.
pub fn what_a_pair_leaves_out_is_mixed<S: Dimension>() {
    let mut w = scene::<S>(exact(1e-3));
    let slippery = MaterialPair { friction: Some(0.02), ..MaterialPair::default() };
    w.set_pair("steel", "ice", slippery).expect("both are known");
    w.set_pair("steel", "steel", MaterialPair { friction: Some(0.3), ..slippery }).expect("known");
    let ball = BodySpec::heavy(S::ball(0.1), 1.0).friction(0.4);
    add(&mut w, "second", ball.clone().at(S::at(0.2, 0.1)).material("steel"));
    add(&mut w, "plain", ball.at(S::at(0.4, 0.1)));
    step(&mut w);
    let friction = |one: usize, other: usize| {
        let pair = |a: usize, b: usize| (a.min(b), a.max(b)) == (one, other);
        w.touches().iter().find(|t| pair(t.a, t.b)).expect("they touch").friction
    };
    assert_eq!([friction(0, 1), friction(1, 2), friction(2, 3)], [0.02, 0.3, 0.4]);
    close(friction(0, 3), 0.6, 1e-15, "mixed with a body of no material");
    let t = w.touches().iter().find(|t| t.friction == 0.02).expect("they touch");
    assert_eq!((t.restitution, t.rolling, t.spinning), (0.8, 0.01, 0.02));
}

/// A restored world has the materials and what was said of them; a snapshot without any is as it was.
pub fn pairs_are_part_of_a_snapshot<S: Dimension>() {
    let mut w = scene::<S>(exact(1e-3));
    let pair = MaterialPair { friction: Some(0.02), ..MaterialPair::default() };
    w.set_pair("steel", "ice", pair).expect("both are known");
    let (mut restored, _) = World::<S>::from_snapshot(&w.snapshot()).expect("a snapshot");
    assert_eq!(restored.pairs().collect::<Vec<_>>(), w.pairs().collect::<Vec<_>>());
    assert_eq!(restored.bodies().material(1), Some("steel"));
    w.motion_mut().velocity[1] = S::at(1.0, 0.0);
    restored.motion_mut().velocity[1] = S::at(1.0, 0.0);
    settle(&mut w, 0.1);
    settle(&mut restored, 0.1);
    assert_eq!(bits(&w), bits(&restored));
    let plain = World::<S>::new(Settings::default()).expect("possible").snapshot();
    assert!(!plain.contains("pairs"));
}

/// Names that no body has, and numbers out of range.
pub fn impossible_pairs_are_refused_by_name<S: Dimension>() {
    let mut w = scene::<S>(exact(1e-3));
    let friction = |mu: f64| MaterialPair { friction: Some(mu), ..MaterialPair::default() };
    let refused = |w: &mut World<S>, one: &str, other: &str, pair: MaterialPair| {
        w.set_pair(one, other, pair).expect_err("refused").to_string()
    };
    let unknown = refused(&mut w, "stele", "ice", friction(0.1));
    assert_eq!(unknown, "material is unknown: 'stele'; did you mean 'steel'?");
    assert!(refused(&mut w, "steel", "ice", friction(-0.1)).contains("friction must be finite and >= 0"));
    let bouncy = MaterialPair { restitution: Some(1.5), ..MaterialPair::default() };
    assert!(refused(&mut w, "steel", "ice", bouncy).contains("restitution must be in [0, 1], got 1.5"));
    assert!(refused(&mut w, "steel", "ice", MaterialPair::default()).contains("has no coefficient"));
    assert_eq!(w.pairs().count(), 0);
    let nameless = BodySpec::heavy(S::ball(0.1), 1.0).material("");
    assert!(w.add("nameless", nameless).expect_err("refused").to_string().contains("material is empty"));
}
