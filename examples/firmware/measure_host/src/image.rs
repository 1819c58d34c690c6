//! What lies in a linked image: sizes by section and symbol, and whether a panic does.

use std::path::Path;

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol};

/// Code and constants of an image, bytes.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// All of it.
    pub text: u64,
    /// Of that, the compiler's float and memory routines.
    pub routines: u64,
}

/// Reads it.
pub fn size(path: &Path) -> Result<Size> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let elf = object::File::parse(&*bytes)?;
    let text = elf
        .sections()
        .filter(|s| matches!(s.name(), Ok(".text" | ".rodata" | ".data")))
        .map(|s| s.size())
        .sum();
    let mut routines = 0;
    let mut seen = std::collections::BTreeSet::new();
    for symbol in elf.symbols().filter(|s| s.size() > 0) {
        let Ok(name) = symbol.name() else { continue };
        // Aliases of one routine have one address.
        if is_routine(name) && seen.insert(symbol.address()) {
            routines += symbol.size();
        }
    }
    Ok(Size { text, routines })
}

fn is_routine(name: &str) -> bool {
    let plain = ["memcpy", "memset", "memmove", "memcmp", "fmax", "fmin", "fmaxf", "fminf"];
    name.starts_with("__aeabi_") || name.contains("compiler_builtins") || plain.contains(&name)
}

/// Symbols that belong to the panic machinery.
pub fn panics(path: &Path) -> Result<Vec<String>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let elf = object::File::parse(&*bytes)?;
    let names = elf.symbols().filter(|s| s.size() > 0).filter_map(|s| s.name().ok().map(String::from));
    Ok(names.filter(|n| n.contains("panic") || n.contains("rust_begin_unwind")).collect())
}

/// Fails with their names where there are any.
pub fn no_panic(path: &Path) -> Result<()> {
    let found = panics(path)?;
    if !found.is_empty() {
        bail!("{}: a panic can be reached: {}", path.display(), found.join(", "));
    }
    Ok(())
}
