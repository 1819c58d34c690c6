//! Links the archive of the C interface and the monitors written in C, which `measure` has put into one folder.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=DRIFT_C_FOLDER");
    let Some(folder) = std::env::var_os("DRIFT_C_FOLDER") else { return };
    let folder = std::path::PathBuf::from(folder);
    // As arguments: what is named as a library is looked through for Rust's bitcode.
    for library in ["libmonitors.a", "libdrift.a"] {
        let archive = folder.join(library);
        println!("cargo::rustc-link-arg={}", archive.display());
        println!("cargo::rerun-if-changed={}", archive.display());
    }
}
