// Tables of a run, which grow at their ends.

// A growing list of numbers in a typed array.
class Numbers {
  constructor(zeros = 0) {
    this.array = new Int32Array(zeros);
    this.length = zeros;
  }

  append(values) {
    if (this.length === 0) {
      this.array = values;
    } else {
      const wide = this.array instanceof Float64Array || values instanceof Float64Array;
      const joined = new (wide ? Float64Array : Int32Array)(this.length + values.length);
      joined.set(this.array.subarray(0, this.length));
      joined.set(values, this.length);
      this.array = joined;
    }
    this.length = this.array.length;
  }
}

// Columns of one length: table.at.born_us[k]; columns with a row for each robot are lists of arrays.
class Table {
  constructor(name, columns, wide = []) {
    this.name = name;
    this.at = {};
    this.length = 0;
    this.lists = Object.fromEntries(columns.map((column) => [column, null]));
    this.wide = new Set(wide);
  }

  // `changed` may change the rows of a column before they are taken.
  append(chunk, changed = {}) {
    for (const column of Object.keys(this.lists)) {
      const given = chunk.rows(`${this.name}.${column}`);
      const rows = changed[column]?.(given) ?? given;
      const lists = this.lists[column] ??= [], before = lists[0]?.length ?? 0;
      rows.forEach((row, k) => {
        lists[k] ??= new Numbers(before);
        lists[k].append(row);
      });
      const arrays = this.lists[column].map((numbers) => numbers.array);
      this.at[column] = this.wide.has(column) ? arrays : arrays[0];
      if (!this.wide.has(column)) this.length = arrays[0].length;
    }
  }

  // Sort the rows by a column, where they are not.
  sort(column) {
    const keys = this.at[column];
    if (keys.every((key, k) => k === 0 || keys[k - 1] <= key)) return;
    const order = Array.from(keys.keys()).sort((a, b) => keys[a] - keys[b]);
    for (const name of Object.keys(this.lists)) {
      const [list] = this.lists[name];
      list.array = list.array.map((_, k) => list.array[order[k]]);
      this.at[name] = list.array;
    }
  }
}
