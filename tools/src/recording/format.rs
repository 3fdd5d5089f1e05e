//! Which format a file is of: by its content, then by its name.

use std::path::Path;

use super::error::RecordingProblem;

/// A format that recordings are read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Text in columns.
    Csv,
    /// CSV compressed by gzip.
    CsvGz,
    /// CSV compressed by Zstandard.
    CsvZst,
    /// Apache Parquet.
    Parquet,
    /// MATLAB level 5: `save` up to `-v7`, SciPy's `savemat`.
    Mat5,
    /// MATLAB 7.3: HDF5 behind a header.
    Mat73,
    /// ASAM MDF 4.
    Mdf4,
    /// MCAP, as ROS 2 records.
    Mcap,
}

impl Format {
    /// Its name, as its users call it.
    pub fn name(self) -> &'static str {
        match self {
            Format::Csv => "CSV",
            Format::CsvGz => "CSV in gzip",
            Format::CsvZst => "CSV in Zstandard",
            Format::Parquet => "Parquet",
            Format::Mat5 => "MAT 5",
            Format::Mat73 => "MAT 7.3",
            Format::Mdf4 => "MDF 4",
            Format::Mcap => "MCAP",
        }
    }

    /// Endings of the files that a folder is searched for.
    pub const ENDINGS: [&'static str; 9] = ["csv", "tsv", "txt", "gz", "zst", "parquet", "mat", "mf4", "mcap"];

    /// Judges by the first bytes of a file.
    ///
    /// # Errors
    /// A format that is not read, with how to export it.
    pub fn of(head: &[u8], path: &Path) -> Result<Format, RecordingProblem> {
        const READ: [(&[u8], Format); 7] = [
            (b"\x1f\x8b", Format::CsvGz),
            (b"\x28\xb5\x2f\xfd", Format::CsvZst),
            (b"PAR1", Format::Parquet),
            (b"MATLAB 5.0 MAT-file", Format::Mat5),
            (b"MATLAB 7.3 MAT-file", Format::Mat73),
            (b"MDF     4", Format::Mdf4),
            (b"\x89MCAP0\r\n", Format::Mcap),
        ];
        if let Some((_, format)) = READ.iter().find(|(magic, _)| head.starts_with(magic)) {
            return Ok(*format);
        }
        let foreign = FOREIGN.iter().find(|(magic, ..)| head.starts_with(magic));
        if let Some((_, format, export)) = foreign {
            return Err(RecordingProblem::Foreign { format, export });
        }
        const MODEL: &str = "name the model file first (gmhm predict, diagnose), or after --model (gmhm fit, health)";
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let binary = head.contains(&0);
        if ending == "toml" && !binary {
            return Err(RecordingProblem::Foreign { format: "a model file", export: MODEL });
        }
        match NAMED.iter().find(|(name, ..)| *name == ending) {
            Some((_, format, export)) if binary => Err(RecordingProblem::Foreign { format, export }),
            _ => Ok(Format::Csv),
        }
    }
}

const BY_PANDAS: &str = "export it as CSV or Parquet, in Python by pandas: to_csv or to_parquet";
const SHEET: &str = "save the sheet as CSV (in Excel: Save As, CSV UTF-8)";
const UNPACK: &str = "unpack it, or pack the CSV by gzip or zstd";

/// Formats that are not read: how they begin, what they are, how to export them.
const FOREIGN: [(&[u8], &str, &str); 20] = [
    (b"PK\x03\x04", "a ZIP archive or an Excel workbook (XLSX)", SHEET),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (XLS)", SHEET),
    (
        b"TDSm",
        "a TDMS file of LabVIEW",
        "export it as CSV, in Python by nptdms: TdmsFile.read(f).as_dataframe().to_csv(…)",
    ),
    (
        b"LabVIEW Measurement",
        "a measurement file of LabVIEW (LVM)",
        "export it as CSV with names and units in the header: in LabVIEW without a segment header, in Python by pandas: read_csv(f, sep='\\t', skiprows=22)",
    ),
    (
        b"\x89HDF\r\n\x1a\n",
        "an HDF5 file without MATLAB's header",
        "export it as CSV or Parquet, in Python by h5py or pandas; MATLAB writes MAT by save -v7.3",
    ),
    (b"#ROSBAG V", "a bag of ROS 1", "convert it: mcap convert FILE.bag FILE.mcap"),
    (
        b"SQLite format 3\0",
        "an SQLite database, as older ROS 2 bags are",
        "convert it: ros2 bag convert, storage mcap; or mcap convert FILE.db3 FILE.mcap",
    ),
    (
        b"MDF     3",
        "an MDF file of version 3",
        "convert it to version 4, in Python by asammdf: MDF(f).convert(\"4.10\").save(…)",
    ),
    (
        b"UnFinMF ",
        "an MDF file that was not finished",
        "finish it, in Python by asammdf: MDF(f).save(…), or by the tool that recorded it",
    ),
    (b"ARROW1", "an Arrow or Feather file", BY_PANDAS),
    (b"\xff\xff\xff\xff", "an Arrow stream", BY_PANDAS),
    (b"\x93NUMPY", "an array of NumPy", "export it by numpy.savetxt, with a header, or by scipy.io.savemat"),
    (b"LOGG", "a Vector BLF log", "convert it to MDF 4 or CSV, by the tool that recorded it"),
    (b"GMHM", "a parameter block", "show it by gmhm inspect; a recording is CSV, Parquet, MAT, MDF 4 or MCAP"),
    (b"BZh", "compressed by bzip2", UNPACK),
    (b"\xfd7zXZ\0", "compressed by xz", UNPACK),
    (b"7z\xbc\xaf", "a 7z archive", UNPACK),
    (b"%PDF", "a PDF document", "export the numbers as CSV"),
    (b"<", "XML or HTML", "export the numbers as CSV; a download may have given a page for the file"),
    (b"{", "JSON", BY_PANDAS),
];

/// Formats without a beginning of their own, by the ending of the name.
const NAMED: [(&str, &str, &str); 4] = [
    ("mat", "a MAT file older than level 5", "save it again in MATLAB by save -v7 or -v7.3"),
    ("blf", "a Vector BLF log", "convert it to MDF 4 or CSV, by the tool that recorded it"),
    ("dat", "binary data", "export it as CSV, MDF 4 or MAT, by the tool that recorded it"),
    ("pkl", "a pickle of Python", BY_PANDAS),
];
