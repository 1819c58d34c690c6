//! Host programs that show the two crates in use: see `src/bin`.
