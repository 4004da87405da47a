//! Tables of studies as Parquet: the same cells as in CSV.

use crate::program::Place;
use crate::study_support::study;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

#[test]
fn parquet_has_the_cells_of_the_table() {
    let place = Place::with(&study(30).replace("from: 1.4", "from: 1.2"));
    place.run(&["run", "m.yaml"]).ends_with(0);
    let table = place.table("results/m/study.csv");
    let file = std::fs::File::open(place.path("results/m/study.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let rows: Vec<_> = reader
        .get_row_iter(None)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(rows.len(), 30);
    for (row, cells) in rows.iter().zip(&table[1..]) {
        for ((name, field), (wanted, cell)) in row.get_column_iter().zip(table[0].iter().zip(cells))
        {
            assert_eq!(name, wanted);
            match field {
                Field::Double(x) => assert_eq!(*x, cell.parse::<f64>().unwrap()),
                Field::Long(i) => assert_eq!(*i, cell.parse::<i64>().unwrap()),
                Field::Str(text) => assert_eq!(text, cell),
                Field::Null => assert_eq!(cell, ""),
                other => panic!("{name}: {other:?}"),
            }
        }
    }
    let manifest = place.read("results/m/manifest.json");
    assert!(manifest.contains("\"study.parquet\""), "{manifest}");
}
