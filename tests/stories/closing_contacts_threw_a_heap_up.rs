//! Five boxes fall on each other, plastic arrivals within the step. A contact whose feature changed on the way was
//! corrected by a target that pushed apart: one step gained a billion times the energy there was.

use crate::harness::{add, add_floor, world};
use carom::{
    BodySpec, EventSettings, PlasticArrivals, Quaternion, Scheme, Settings, Spatial, SpatialShape, vec3,
};

/// Size \[m\], place \[m\] and quaternion of each box: the smallest heap that showed it.
const BOXES: [([f64; 3], [f64; 3], [f64; 4]); 5] = [
    (
        [0.18269722766055607, 0.24872768433379255, 0.18187108384855166],
        [-0.015270131629277636, -0.04716556842326708, 0.25],
        [-0.1387329091113837, -0.9124446495034094, -0.07453066191775239, -0.37768124385014734],
    ),
    (
        [0.1978965454162717, 0.17413521450846822, 0.17571452485511296],
        [-0.02928953938101287, 0.010908342211849387, 0.6699999999999999],
        [0.4407500122982562, 0.7717439837024255, -0.3350474675863664, 0.3128799206439431],
    ),
    (
        [0.2104272296058456, 0.21468580270601878, 0.2411356380448524],
        [-0.03821352751647246, -0.01263977024416766, 1.0899999999999999],
        [0.15161556870539275, -0.9630218823072872, 0.21155741299299766, -0.06960628226805494],
    ),
    (
        [0.18933107100863242, 0.21167279444070008, 0.19522665288271462],
        [-0.048466987976622355, -0.016099210239864485, 1.51],
        [-0.30654966156550084, -0.7976054324701108, -0.02917116053387852, 0.5186539525361308],
    ),
    (
        [0.1960179307489958, 0.2218988643889514, 0.2367024869335413],
        [-0.04574674688420517, -0.014997389316204056, 1.93],
        [-0.5091671605986876, 0.489483430552313, -0.3366899077941636, -0.6227316274063547],
    ),
];

#[test]
fn closing_contacts_never_push_apart() {
    let plastic_arrivals = PlasticArrivals::WithinTheStep;
    let events = EventSettings { plastic_arrivals, tolerance: 1e-8, ..EventSettings::default() };
    let (dt, scheme) = (1.0 / 60.0, Scheme::Events);
    let mut w = world::<Spatial>(Settings { dt, scheme, events, ..Settings::default() });
    add_floor(&mut w, 0.5, 0.0);
    for (k, (size, [x, y, z], turn)) in BOXES.into_iter().enumerate() {
        let body = BodySpec::dense(SpatialShape::Box { size }, 1000.0).at(vec3(x, y, z));
        let body = body.turned(Quaternion(turn)).friction(0.5).restitution(0.0);
        add(&mut w, &format!("box {k}"), body);
    }
    let start = w.energy().total();
    let mut before = start;
    for _ in 0..54 {
        let now = w.step(dt).expect("a sound step").energy.total();
        assert!(now - before <= 1e-8 * start, "gained {} J of {start} at {}", now - before, w.time());
        before = now;
    }
}
