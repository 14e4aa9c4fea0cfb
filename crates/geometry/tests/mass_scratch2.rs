mod mass_common;
use mass_common::*;
use carom_geometry::{mass_spatial};
use carom_math::*;
#[test]
fn truth() {
    for s in spatial_shapes() {
        let m = mass_spatial::mass_properties(&s, 900.0).unwrap().mass;
        println!("{:.12} all-in {:.6}", format!("{s:?}"), m + 4000.0*4.0/3.0*std::f64::consts::PI*0.008);
    }
    // union bound by dense midpoint sampling through the ball only: fraction of ball inside via density of the shape's own quadrature is what we test
    let s = &spatial_shapes()[9];
    for tol in [1e-3,1e-4] { for r in [0.2f64, 0.21, 0.19] {
        let q = mass_spatial::mass_properties_of(s, &mut |p| p.iter().map(|p| if (*p-vec3(0.1,0.05,-0.1)).norm()<r {1.0} else {0.0}).collect(), tol);
        println!("{tol} {r} {:?} exact if inside {}", q.map(|q| (q.mass,q.error)), 4.0/3.0*std::f64::consts::PI*r*r*r);
    }}
}
