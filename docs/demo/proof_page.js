// A file of a proof in, its verdict out; a long proof is checked off the page's own thread.
const page = document.getElementById("proof-check");
const verdict = page.querySelector(".verdict");
const input = page.querySelector("input");

function checked(text) {
  const worker = new Worker(new URL("proof_worker.js", import.meta.url), { type: "module" });
  return new Promise((resolve) => {
    worker.addEventListener("message", ({ data }) => resolve(data));
    worker.addEventListener("error", ({ message }) => resolve({ refused: message }));
    worker.postMessage(text);
  }).finally(() => worker.terminate());
}

input.addEventListener("change", async () => {
  const [file] = input.files;
  if (!file) return;
  verdict.textContent = "Checking ...";
  const { sentence, refused } = await checked(await file.text());
  verdict.textContent = sentence ?? `Refused: ${refused}`;
  verdict.classList.toggle("short", sentence === undefined);
});
verdict.textContent = "Choose a file that finlab layout prove has written.";
