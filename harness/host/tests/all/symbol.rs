use host::symbol::readable;

#[test]
fn mangled_symbol_names_are_demangled_or_left_as_they_are() {
    for (symbol, name) in [
        ("cos", Some("cos")),
        ("_Py_NoneStruct", Some("_Py_NoneStruct")),
        ("_ZN9pythonfmu7PyState4callEv", Some("pythonfmu::PyState::call")),
        ("_ZNK9pythonfmu7PyState4callEv", Some("pythonfmu::PyState::call")),
        ("_ZTVN7fmu4cpp9fmu_slaveE", Some("{vtable(fmu4cpp::fmu_slave)}")),
        (
            "_ZNSt6vectorIdSaIdEE9push_backEOd",
            Some("std::vector<double, std::allocator<double> >::push_back"),
        ),
        ("_Z4openPKc", Some("open")),
        ("__ZN4core3fmt5write17h0123456789abcdefE", Some("core::fmt::write")),
        ("?push@Stack@ns@@QEAAXXZ", Some("ns::Stack::push")),
        ("??0Stack@ns@@QEAA@XZ", None),
        ("_RNvCs1234_7mycrate3foo", Some("mycrate::foo")),
        ("_Reset", Some("_Reset")),
        ("_ZdlPv", Some("operator delete")),
        ("_Zunreadable", None),
    ] {
        assert_eq!(readable(symbol).as_deref(), name, "{symbol}");
    }
    let long = "a".repeat(1000);
    for symbol in [long.clone(), format!("_Z1000{long}v"), format!("?{long}@ns@@QEAAXXZ")] {
        assert_eq!(readable(&symbol).unwrap().chars().count(), 61, "{symbol}");
    }
}
