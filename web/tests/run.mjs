// The page of amontons studio in a real browser, driven by roles and labels.
//
// usage: node run.mjs PROGRAM [FOLDER OF PICTURES [PATTERN OF NAMES]]
//
// Exit code 77 (skipped) where Chromium or playwright-core is missing.

import { finish } from "./harness.mjs";

for (const part of ["scene", "looking", "picking", "hand", "survival"]) await import(`./${part}.mjs`);
await finish();
