// A run that goes on: the server that has sent this page sends its chunks, too.

const STREAM = "/stream";

// The app of the run, when its first chunk is there.
function streamed() {
  return new Promise((resolve, reject) => {
    const source = new EventSource(STREAM);
    let app = null, chunks = Promise.resolve();
    const take = async (data) => {
      const [about, text] = JSON.parse(data);
      const columns = new Columns(about.columns, await inflated(text));
      if (app) { app.append(about, columns); return; }
      const run = new Run(about);
      run.append(about, columns);
      app = new App([run]);
      app.goesOn();
      resolve(app);
    };
    source.onmessage = ({ data }) => { chunks = chunks.then(() => take(data)).catch(reject); };
    source.addEventListener("over", () => {
      source.close();
      chunks = chunks.then(() => app?.over());
    });
  });
}
