// Search over the sections in search-index.js: the stem of every word typed must begin a word of the section.
"use strict";
const field = document.getElementById("search");
const found = document.getElementById("found");
const pages = document.getElementById("pages");

// The reader keeps the place in the list of pages: the present page stands in the middle of the sidebar, if the sidebar scrolls.
const sidebar = document.querySelector("nav"), present = pages.querySelector("[aria-current]");
if (present && sidebar.scrollHeight > sidebar.clientHeight) {
  const from = sidebar.getBoundingClientRect().top, at = present.getBoundingClientRect().top;
  sidebar.scrollTop += at - from - sidebar.clientHeight / 2;
}

function wordsOf(text) {
  return text.toLowerCase().split(/[^\p{L}\p{N}_.]+/u).filter(Boolean);
}

// British and American spelling and doubled letters made the same, in what is asked and in the pages:
// linearise and linearize, behaviour and behavior, centre and center, manoeuvre and maneuver, controller
// and controler, licence and license.
function spelled(word) {
  return word
    .replace(/z/g, "s").replace(/our/g, "or").replace(/oeu/g, "eu").replace(/ogue/g, "og").replace(/nce(?=s?$)/, "nse")
    .replace(/([tv])re(?=s?$)/, "$1er")
    .replace(/(\p{L})\1+/gu, (run, letter) => (run.length === 2 ? letter : run));
}

// A word without its English ending, if four letters or more are left: "oscillations" finds oscillation,
// "linearisation" linearise.
function stem(word) {
  return spelled(word).replace(/(?<=^\p{L}{4,})(ations?|ions?|ies|es|e|s|ed|ing)$/u, "");
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
function load() {
  sections ??= SECTIONS.map((s) => ({ ...s, inTitle: wordsOf(s.title).map(spelled), inText: wordsOf(s.words).map(spelled) }));
  return sections;
}

function search(text) {
  load();
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

// Letters to add, drop, change or swap with the next to make one word of another (Damerau, Levenshtein).
function distance(a, b) {
  const rows = [Array.from({ length: b.length + 1 }, (_, j) => j)];
  for (let i = 1; i <= a.length; i++) {
    rows.push([i]);
    for (let j = 1; j <= b.length; j++) {
      let least = Math.min(rows[i - 1][j] + 1, rows[i][j - 1] + 1, rows[i - 1][j - 1] + (a[i - 1] !== b[j - 1]));
      if (i > 1 && j > 1 && a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1]) least = Math.min(least, rows[i - 2][j - 2] + 1);
      rows[i].push(least);
    }
  }
  return rows[a.length][b.length];
}

// What was probably meant: each word that is nowhere replaced by the nearest one in the pages, the most
// frequent of several; null if there is none within a third of its letters.
function meant(text) {
  const known = new Map();
  for (const section of load()) {
    for (const word of wordsOf(section.words)) if (/^\p{L}{3,}$/u.test(word)) known.set(word, (known.get(word) ?? 0) + 1);
  }
  let changed = false;
  const words = wordsOf(text).map((word) => {
    if (search(word).length) return word;
    let best = [Math.min(2, word.length / 3) + 1e-9, 0, null];
    for (const [other, count] of known) {
      if (Math.abs(other.length - word.length) > 2) continue;
      const away = distance(word, other);
      if (away < best[0] || (away === best[0] && count > best[1])) best = [away, count, other];
    }
    changed ||= best[2] !== null;
    return best[2] ?? word;
  });
  const corrected = words.join(" ");
  return changed && search(corrected).length ? corrected : null;
}

// What is said where nothing is found.
function nothing(text) {
  const instead = meant(text);
  const parts = [`No page has “${text.trim()}”.`];
  if (instead) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = instead;
    button.addEventListener("click", () => { field.value = instead; field.dispatchEvent(new Event("input")); field.focus(); });
    parts.push(" Did you mean ", button, "?");
  } else if (wordsOf(text).length > 1) parts.push(" Try fewer words.");
  else parts.push(" Try another word; the pages are listed when this field is empty.");
  return parts;
}

// Some words around the first one that was asked for.
function excerpt(section, asked) {
  const words = [...section.words.matchAll(/[\p{L}\p{N}_.]+/gu)];
  const first = words.find((word) => spelled(word[0].toLowerCase()).includes(asked));
  const at = Math.max(0, (first?.index ?? 0) - 40);
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
  if (asked.length && !found.children.length) found.replaceChildren(...nothing(field.value));
});
field.addEventListener("keydown", (event) => {
  if (event.key === "Enter") found.querySelector("a")?.click();
  if (event.key === "Escape") { field.value = ""; field.dispatchEvent(new Event("input")); }
});
document.addEventListener("keydown", (event) => {
  if (event.key === "/" && document.activeElement !== field) { event.preventDefault(); field.focus(); }
});
