//! Links the C++ library that Jolt needs, where Jolt races.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_JOLT").is_some() {
        println!("cargo:rustc-link-arg=-lstdc++");
    }
}
