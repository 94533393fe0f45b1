// The search in sorted lists.

// The number of sorted values that are at most `limit`.
function countUpTo(values, limit, length = values.length) {
  let low = 0, high = length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= limit) low = middle + 1; else high = middle;
  }
  return low;
}
