//! The deck with every default, as TOML that reads back to the same deck.
use super::model::Deck;
pub fn resolved(_deck: &Deck) -> String {
    String::new()
}
