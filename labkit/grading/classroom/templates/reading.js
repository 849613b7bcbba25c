"use strict";

// Keeps what is typed, as a draft of this browser, until it is saved as a table.

const page = document.body.dataset;
const DRAFT = `labkit points ${page.title} ${page.draft}`;
const handIns = [...document.querySelectorAll("article")];
const choice = document.querySelector("#choice");
const saving = document.querySelector("#save");
const fields = [...document.querySelectorAll("fieldset[data-item]")];
let isSaved = true;

function show(place) {
  const chosen = Math.max(0, Math.min(handIns.length - 1, place));
  handIns.forEach((handIn, index) => {
    handIn.hidden = index !== chosen;
  });
  choice.selectedIndex = chosen;
  window.scrollTo(0, 0);
}

function keyOf(field) {
  return JSON.stringify([field.dataset.student, field.dataset.item]);
}

function partsOf(field) {
  const [value, comment] = field.querySelectorAll("input, textarea");
  return [value, comment];
}

function valuesOf(field) {
  return partsOf(field).map((part) => part.value.trim());
}

function keepDraft() {
  const draft = {};
  fields.forEach((field) => {
    draft[keyOf(field)] = valuesOf(field);
  });
  try {
    localStorage.setItem(DRAFT, JSON.stringify(draft));
  } catch {
    // The page works without it; the warning on leaving is left.
  }
  isSaved = false;
  saving.textContent = `Save ${page.file} *`;
}

function restoreDraft() {
  let draft = {};
  try {
    draft = JSON.parse(localStorage.getItem(DRAFT) || "{}");
  } catch {
    return;
  }
  fields.forEach((field) => {
    const texts = draft[keyOf(field)] || valuesOf(field);
    partsOf(field).forEach((part, index) => {
      if (!part.disabled) {
        part.value = texts[index];
      }
    });
  });
}

function cell(text) {
  return `"${text.replaceAll('"', '""').replace(/\s+/g, " ")}"`;
}

function table() {
  const lines = fields
    .filter((field) => !field.disabled && valuesOf(field).some((text) => text))
    .map((field) => [field.dataset.student, field.dataset.item, ...valuesOf(field)].map(cell));
  return [page.columns, ...lines.map((line) => line.join(","))].join("\n") + "\n";
}

function isValid(field) {
  const [value] = valuesOf(field);
  const maximum = Number(field.dataset.maximum || Infinity);
  const number = Number(value.replace(",", "."));
  const isNumber = value !== "" && number >= 0 && number <= maximum && field.dataset.item !== "all";
  const isExcuse = value === "excused" && field.dataset.item !== "bonus";
  return value === "" || isNumber || isExcuse;
}

function mark(field) {
  const [value] = partsOf(field);
  value.setCustomValidity(isValid(field) ? "" : field.dataset.allowed);
}

function save() {
  const bad = fields.find((field) => !field.disabled && !isValid(field));
  if (bad) {
    show(handIns.indexOf(bad.closest("article")));
    mark(bad);
    partsOf(bad)[0].reportValidity();
    return;
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([table()], { type: "text/csv" }));
  link.download = page.file;
  link.click();
  isSaved = true;
  saving.textContent = `Save ${page.file}`;
}

document.querySelector("#back").onclick = () => show(choice.selectedIndex - 1);
document.querySelector("#next").onclick = () => show(choice.selectedIndex + 1);
choice.onchange = () => show(choice.selectedIndex);
saving.onclick = save;
fields.forEach((field) => {
  field.oninput = keepDraft;
  field.onchange = () => mark(field);
});
window.onbeforeunload = (event) => {
  if (!isSaved) {
    event.preventDefault();
  }
};
restoreDraft();
show(0);
