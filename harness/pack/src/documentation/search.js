// Search over the sections in search-index.js: the stem of every word typed must begin a word of the section.
"use strict";
const field = document.getElementById("search");
const found = document.getElementById("found");
const pages = document.getElementById("pages");

function wordsOf(text) {
  return text.toLowerCase().split(/[^\p{L}\p{N}_.]+/u).filter(Boolean);
}

// A word without its English ending, if four letters or more are left: "oscillations" finds oscillation.
function stem(word) {
  return word.replace(/(?<=^\p{L}{4,})(ions?|ies|es|s|ed|ing)$/u, "");
}

// Where a word begins with what is asked, as whole variables (`slosh.model`) or their parts.
function matches(words, asked) {
  let count = 0;
  for (const word of words) {
    if (word.startsWith(asked)) count += word === asked ? 2 : 1;
    else if (word.split(/[._]/).some((part) => part.startsWith(asked))) count += 0.5;
  }
  return count;
}

let sections = null; // split into words when the first letter is typed
function search(text) {
  sections ??= SECTIONS.map((s) => ({ ...s, inTitle: wordsOf(s.title), inText: wordsOf(s.words) }));
  const asked = wordsOf(text).map(stem);
  const ranked = [];
  for (const section of sections) {
    let rank = 0;
    for (const word of asked) {
      const here = 20 * matches(section.inTitle, word) + Math.min(10, matches(section.inText, word));
      if (here === 0) { rank = 0; break; }
      rank += here;
    }
    if (rank > 0) ranked.push([rank, section]);
  }
  return ranked.sort((a, b) => b[0] - a[0]).slice(0, 15).map(([, section]) => section);
}

// Some words around the first one that was asked for.
function excerpt(section, asked) {
  const at = Math.max(0, section.words.toLowerCase().indexOf(asked) - 40);
  return (at > 0 ? "… " : "") + section.words.slice(at, at + 120).trim();
}

field.addEventListener("input", () => {
  const asked = wordsOf(field.value);
  pages.hidden = asked.length > 0;
  found.replaceChildren(...(asked.length ? search(field.value) : []).map((section) => {
    const item = document.createElement("li");
    const link = document.createElement("a");
    const text = document.createElement("small");
    link.href = section.at;
    link.textContent = section.title;
    text.textContent = excerpt(section, stem(asked[0]));
    item.append(link, text);
    return item;
  }));
  if (asked.length && !found.children.length) found.textContent = "Nothing found.";
});
field.addEventListener("keydown", (event) => {
  if (event.key === "Enter") found.querySelector("a")?.click();
  if (event.key === "Escape") { field.value = ""; field.dispatchEvent(new Event("input")); }
});
document.addEventListener("keydown", (event) => {
  if (event.key === "/" && document.activeElement !== field) { event.preventDefault(); field.focus(); }
});
