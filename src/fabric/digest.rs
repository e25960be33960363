//! The digest that names a prior, a dataset or a model exactly.

/// SHA-256 in lower-case hexadecimal: names priors, datasets and models exactly.
#[must_use]
pub fn sha256_hex(bytes: &[u8]) -> String {
    use sha2::Digest as _;
    sha2::Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
