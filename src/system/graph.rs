//! Which nodes share an equation: the union of the supports that hold a node is the node's row.

/// Lists of small indices, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Lists {
    /// List s is `items[offsets[s]..offsets[s + 1]]`.
    pub offsets: Vec<usize>,
    pub items: Vec<u32>,
}

impl Lists {
    pub fn with_capacity(lists: usize, items: usize) -> Self {
        let mut offsets = Vec::with_capacity(lists + 1);
        offsets.push(0);
        Lists { offsets, items: Vec::with_capacity(items) }
    }

    #[inline]
    pub fn close(&mut self) {
        self.offsets.push(self.items.len());
    }

    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    pub fn list(&self, s: usize) -> &[u32] {
        &self.items[self.offsets[s]..self.offsets[s + 1]]
    }

    /// For each of `count` indices, the lists that hold it, ascending.
    pub fn transposed(&self, count: usize) -> Lists {
        let mut offsets = vec![0; count + 1];
        for &item in &self.items {
            offsets[item as usize + 1] += 1;
        }
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut cursor = offsets.clone();
        let mut items = vec![0; self.items.len()];
        for s in 0..self.len() {
            for &item in self.list(s) {
                let place = &mut cursor[item as usize];
                items[*place] = s as u32;
                *place += 1;
            }
        }
        Lists { offsets, items }
    }
}

/// Row r: every index that shares a list with r, ascending. `holders` is `lists` transposed.
pub fn neighbours(lists: &Lists, holders: &Lists) -> Lists {
    let count = holders.len();
    let mut rows = Lists::with_capacity(count, 9 * count);
    // The last row that took an index in.
    let mut taken = vec![u32::MAX; count];
    for r in 0..count {
        let start = rows.items.len();
        for &s in holders.list(r) {
            for &item in lists.list(s as usize) {
                if taken[item as usize] != r as u32 {
                    taken[item as usize] = r as u32;
                    rows.items.push(item);
                }
            }
        }
        rows.items[start..].sort_unstable();
        rows.close();
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_unions_of_lists() {
        let mut lists = Lists::with_capacity(3, 8);
        for list in [&[2u32, 0, 3][..], &[3, 4], &[1]] {
            lists.items.extend_from_slice(list);
            lists.close();
        }
        let holders = lists.transposed(6);
        assert_eq!(holders.list(3), [0, 1]);
        let rows = neighbours(&lists, &holders);
        let all: Vec<&[u32]> = (0..6).map(|r| rows.list(r)).collect();
        assert_eq!(all, [&[0, 2, 3][..], &[1], &[0, 2, 3], &[0, 2, 3, 4], &[3, 4], &[]]);
    }
}
