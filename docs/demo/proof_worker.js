// Checks the text of a proof that the page sends.
import { check } from "./check_proof.js";

addEventListener("message", ({ data }) => {
  try {
    postMessage({ sentence: check(data) });
  } catch (error) {
    postMessage({ refused: error.message });
  }
});
