// Makes the page of HTML reports: node build.mjs SOURCE NPM OUTPUT
//   SOURCE  this folder; NPM  the folder with node_modules; OUTPUT  the C++ file with the page as an array
// Scripts and styles stand in the page and are named by their hashes in its content security policy, which forbids
// everything else.
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [source, npm, output] = process.argv.slice(2);
const modules = path.join(npm, "node_modules");
const { buildSync } = createRequire(path.join(modules, "package.json"))("esbuild");

function bundle(entry) {
  const result = buildSync({
    entryPoints: [path.join(source, entry)],
    nodePaths: [modules],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: ["chrome100", "firefox100", "safari15"],
    charset: "ascii",
    legalComments: "inline",
    logLevel: "warning",
  });
  return result.outputFiles[0].text.trim();
}

const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
const script = bundle("src/main.js");
const style = bundle("style.css");
if (/<\/(script|style)/i.test(script + style)) throw new Error("a bundle holds an end tag");
const policy =
  `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; img-src data:; ` +
  "base-uri 'none'; form-action 'none'";

// Replacements as functions, since bundles may hold "$&".
const page = readFileSync(path.join(source, "page.html"), "utf8")
  .replace("LICENCE", () => readFileSync(path.join(modules, "uplot", "LICENSE"), "utf8").trim())
  .replace("POLICY", () => policy)
  .replace("/*STYLE*/", () => style)
  .replace("/*SCRIPT*/", () => script);

const bytes = [...Buffer.from(page, "utf8")];
if (bytes.some((byte) => byte > 127)) throw new Error("the page holds characters outside ASCII");
const lines = [];
for (let at = 0; at < bytes.length; at += 32) lines.push(bytes.slice(at, at + 32).join(","));
writeFileSync(
  output,
  `// Made by cli/report/html/build.mjs.
#include "cli/report/html_writer.h"

namespace ecaudit::report {
namespace {

constexpr char kPage[] = {
${lines.join(",\n")}};

}  // namespace

std::string_view MissingHtml() {
  return {};
}

std::string_view HtmlPage() {
  return {kPage, sizeof kPage};
}

}  // namespace ecaudit::report
`,
);
