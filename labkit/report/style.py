"""The look of a report, on a screen and on A4."""

CSS = """\
@page { size: A4; margin: 16mm 18mm 18mm; }
body { margin: 0; color: #111; background: #fff; }
main { max-width: 174mm; margin: 0 auto; padding: 1.2rem; }
main { font: 10pt/1.38 "Helvetica Neue", Arial, "Liberation Sans", sans-serif; }
main { overflow-wrap: anywhere; }
@media print { main { padding: 0; } }
h1 { font-size: 16pt; line-height: 1.2; margin: 0 0 .4em; }
h2 { font-size: 11.5pt; margin: 1em 0 .3em; break-after: avoid; }
p, ul, ol { margin: .35em 0; }
ul, ol { padding-left: 1.4em; }
code { font: .92em Menlo, Consolas, "Liberation Mono", monospace; }
pre { font: 8.5pt/1.3 Menlo, Consolas, "Liberation Mono", monospace; white-space: pre-wrap; }
table { border-collapse: collapse; margin: .4em 0; font-size: 9pt; width: 100%; }
th, td { padding: .15em .5em; border-bottom: .4pt solid #aaa; vertical-align: top; }
td { min-width: 4em; }
th, td:first-child, td[style*="right"], td code { overflow-wrap: normal; }
table:has(tr > :nth-child(9)) { font-size: 6.5pt; }
table:has(tr > :nth-child(9)) :is(td, th) { padding: .15em .2em; min-width: 0; }
table:has(tr > :nth-child(9)) :is(td, th, code) { overflow-wrap: anywhere; }
thead th { border-bottom: 1pt solid #111; text-align: left; }
table, img, figure { break-inside: avoid; }
td[style*="right"], th[style*="right"] { font-variant-numeric: tabular-nums; }
img { display: block; width: auto; height: auto; max-width: 100%; max-height: 100mm; }
img { margin: .3em auto; }
.jp-OutputPrompt, .jp-InputPrompt, .anchor-link { display: none; }
.jp-RenderedText pre { margin: .3em 0; }
@media (max-width: 600px) { .jp-OutputArea-output, table { display: block; overflow-x: auto; } }
"""
