//! Reads an XDMF file independently of the writer.

use std::collections::BTreeMap;
use std::path::Path;

use quick_xml::events::Event;

#[derive(Debug, Default)]
pub struct FoundGrid {
    pub time: String,
    pub topology: String,
    /// Name, stated dimensions, file, dataset.
    pub items: Vec<(String, Vec<usize>, String, String)>,
}

/// Reads an XDMF file as a reader would: every element closed, every data item with its shape.
pub fn read_xdmf(path: &Path) -> Vec<FoundGrid> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut reader = quick_xml::Reader::from_str(&text);
    reader.config_mut().check_end_names = true;
    let mut grids: Vec<FoundGrid> = Vec::new();
    let (mut name, mut dimensions, mut in_item, mut depth) = (String::new(), vec![], false, 0);
    loop {
        let event = reader.read_event().unwrap();
        let opened = matches!(event, Event::Start(_));
        match event {
            Event::Eof => break,
            Event::Start(element) | Event::Empty(element) => {
                depth += usize::from(opened);
                let attributes: BTreeMap<String, String> = element
                    .attributes()
                    .map(|attribute| {
                        let attribute = attribute.unwrap();
                        (attribute.key.as_ref().to_string(), attribute.value.to_string())
                    })
                    .collect();
                match element.name().as_ref() {
                    "Grid" if attributes["GridType"] == "Uniform" => {
                        grids.push(FoundGrid::default())
                    }
                    "Grid" => assert_eq!(attributes["CollectionType"], "Temporal"),
                    "Time" => grids.last_mut().unwrap().time = attributes["Value"].clone(),
                    "Topology" => {
                        assert!(attributes.contains_key("NodesPerElement"));
                        grids.last_mut().unwrap().topology = attributes["TopologyType"].clone();
                        name = "topology".into();
                    }
                    "Geometry" => {
                        assert_eq!(attributes["GeometryType"], "XYZ");
                        name = "geometry".into();
                    }
                    "Attribute" => name = attributes["Name"].clone(),
                    "DataItem" => {
                        let words = attributes["Dimensions"].split(' ');
                        dimensions = words.map(|word| word.parse().unwrap()).collect();
                        in_item = true;
                    }
                    _ => {}
                }
            }
            Event::Text(text) if in_item => {
                let text = text.to_string();
                let (file, dataset) = text.trim().split_once(":/").unwrap();
                let item = (name.clone(), dimensions.clone(), file.into(), dataset.into());
                grids.last_mut().unwrap().items.push(item);
            }
            Event::End(_) => {
                depth -= 1;
                in_item = false;
            }
            _ => {}
        }
    }
    assert_eq!(depth, 0, "{}", path.display());
    grids
}
