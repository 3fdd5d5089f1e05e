//! The object dictionary of a drive as an electronic data sheet for CANopen tools, CiA 306.

use std::fmt::Write as _;

use gmhm::link::objects::{Access, DataType, OBJECTS, Object, highest_sub, record_name};

/// Object types of CiA 301.
const VARIABLE: u8 = 0x7;
const RECORD: u8 = 0x9;

/// Indices that every CANopen device has.
const MANDATORY: [u16; 3] = [0x1000, 0x1001, 0x1018];
/// Where manufacturers put objects of their own.
const MANUFACTURER: std::ops::Range<u16> = 0x2000..0x6000;

/// The text of the data sheet. Floats are written with their unit in the entry `Unit`, which python canopen reads and other tools skip.
pub fn eds(file_name: &str) -> String {
    let mut text = String::new();
    section(&mut text, "FileInfo");
    for (key, value) in [
        ("FileName", file_name),
        ("FileVersion", "1"),
        ("FileRevision", "0"),
        ("EDSVersion", "4.0"),
        ("Description", "Harmonic-drive hysteresis compensation"),
        ("CreatedBy", concat!("gmhm ", env!("CARGO_PKG_VERSION"))),
    ] {
        entry(&mut text, key, value);
    }
    section(&mut text, "DeviceInfo");
    entry(&mut text, "VendorName", "");
    entry(&mut text, "VendorNumber", "0x0");
    entry(&mut text, "ProductName", "gmhm");
    entry(&mut text, "ProductNumber", "0x0");
    entry(&mut text, "RevisionNumber", "0x0");
    for rate in [10, 20, 50, 125, 250, 500, 800, 1000] {
        entry(&mut text, &format!("BaudRate_{rate}"), "1");
    }
    for (key, value) in [
        ("SimpleBootUpMaster", "0"),
        ("SimpleBootUpSlave", "1"),
        ("Granularity", "0"),
        ("DynamicChannelsSupported", "0"),
        ("GroupMessaging", "0"),
        ("NrOfRXPDO", "0"),
        ("NrOfTXPDO", "0"),
        ("LSS_Supported", "0"),
    ] {
        entry(&mut text, key, value);
    }
    section(&mut text, "DummyUsage");
    for number in 1..=7 {
        entry(&mut text, &format!("Dummy000{number}"), "0");
    }
    let mut indices: Vec<u16> = OBJECTS.iter().map(|object| object.index).collect();
    indices.dedup();
    let is_manufacturers = |index: &u16| MANUFACTURER.contains(index);
    let lists: [(&str, Vec<u16>); 3] = [
        ("MandatoryObjects", indices.iter().copied().filter(|index| MANDATORY.contains(index)).collect()),
        (
            "OptionalObjects",
            indices.iter().copied().filter(|index| !MANDATORY.contains(index) && !is_manufacturers(index)).collect(),
        ),
        ("ManufacturerObjects", indices.iter().copied().filter(is_manufacturers).collect()),
    ];
    for (name, list) in &lists {
        section(&mut text, name);
        entry(&mut text, "SupportedObjects", &list.len().to_string());
        for (k, index) in list.iter().enumerate() {
            entry(&mut text, &(k + 1).to_string(), &format!("0x{index:04X}"));
        }
    }
    for index in indices {
        of_index(&mut text, index);
    }
    text
}

/// The sections of an index.
fn of_index(text: &mut String, index: u16) {
    let entries: Vec<&Object> = OBJECTS.iter().filter(|object| object.index == index).collect();
    section(text, &format!("{index:04X}"));
    match (highest_sub(index), entries.as_slice()) {
        (0, [only]) => variable(text, only),
        (highest, _) => {
            entry(text, "ParameterName", record_name(index));
            entry(text, "ObjectType", &format!("{RECORD:#x}"));
            entry(text, "SubNumber", &(entries.len() + 1).to_string());
            section(text, &format!("{index:04X}sub0"));
            let data_type = DataType::Unsigned8;
            let name = "highest_sub_index";
            variable(text, &Object { index, sub: 0, name, data_type, unit: "", access: Access::ReadOnly, range: None });
            entry(text, "DefaultValue", &highest.to_string());
            for object in entries {
                section(text, &format!("{index:04X}sub{:X}", object.sub));
                variable(text, object);
            }
        }
    }
}

fn variable(text: &mut String, object: &Object) {
    entry(text, "ParameterName", object.name);
    entry(text, "ObjectType", &format!("{VARIABLE:#x}"));
    entry(text, "DataType", &format!("0x{:04X}", object.data_type.number()));
    entry(
        text,
        "AccessType",
        match object.access {
            Access::ReadOnly => "ro",
            Access::WriteOnly => "wo",
            Access::ReadWrite => "rw",
        },
    );
    entry(text, "PDOMapping", "0");
    // Limits of reals are bit patterns in some tools and decimals in others: only those of integers are written.
    if let (Some([low, high]), false) = (object.range, object.data_type == DataType::Real32) {
        entry(text, "LowLimit", &low.to_string());
        entry(text, "HighLimit", &high.to_string());
    }
    if !object.unit.is_empty() {
        entry(text, "Unit", object.unit);
    }
}

fn section(text: &mut String, name: &str) {
    let gap = if text.is_empty() { "" } else { "\n" };
    // A string takes everything.
    let _ = writeln!(text, "{gap}[{name}]");
}

fn entry(text: &mut String, key: &str, value: &str) {
    let _ = writeln!(text, "{key}={value}");
}
