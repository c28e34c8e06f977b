//! Builds the C side, with all that this processor has: the rival shall lack nothing.

fn main() {
    println!("cargo::rerun-if-changed=src/embree.c");
    cc::Build::new()
        .file("src/embree.c")
        .flag("-march=native")
        .flag("-ffast-math")
        .opt_level(3)
        .warnings(true)
        .compile("rival_embree");
    println!("cargo::rustc-link-lib=embree3");
}
