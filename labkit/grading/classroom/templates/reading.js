"use strict";

// Shows one hand-in at a time, and saves as a table what is typed beside them.

const page = document.body.dataset;
const handIns = [...document.querySelectorAll("article")];
const choice = document.querySelector("#choice");
const saving = document.querySelector("#save");
const fields = [...document.querySelectorAll("fieldset[data-item]:enabled")];
let isSaved = true;

function show(place) {
  const chosen = Math.max(0, Math.min(handIns.length - 1, place));
  handIns.forEach((handIn, index) => {
    handIn.hidden = index !== chosen;
  });
  choice.selectedIndex = chosen;
  window.scrollTo(0, 0);
}

function decisionOf(field) {
  const excuse = field.querySelector("[type=checkbox]");
  const points = field.querySelector("[type=number]");
  const value = excuse?.checked ? "excused" : (points?.value ?? "");
  return [value, field.querySelector("textarea").value.trim()];
}

function cell(text) {
  return `"${text.replaceAll('"', '""').replace(/\s+/g, " ")}"`;
}

function table() {
  const lines = fields
    .filter((field) => decisionOf(field).some((text) => text))
    .map((field) => [field.dataset.student, field.dataset.item, ...decisionOf(field)].map(cell));
  return [page.columns, ...lines.map((line) => line.join(","))].join("\n") + "\n";
}

function save() {
  const bad = document.querySelector("input:invalid");
  if (bad) {
    show(handIns.indexOf(bad.closest("article")));
    bad.reportValidity();
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
  field.oninput = () => {
    isSaved = false;
    saving.textContent = `Save ${page.file} *`;
  };
});
window.onbeforeunload = (event) => {
  if (!isSaved) {
    event.preventDefault();
  }
};
show(0);
