#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| scan2params_fuzz::scan(data, "e57"));
