// The page of amontons studio in a real browser, driven by roles and labels.
//
// usage: node run.mjs PROGRAM [FOLDER OF PICTURES [PATTERN OF NAMES [PARTS]]]
//
// Exit code 77 (skipped) where Chromium or playwright-core is missing.

import { finish } from "./harness.mjs";

const parts = process.argv[5]?.split(",") ?? ["scene", "viewing", "picking", "hand", "survival"];
for (const part of parts) await import(`./${part}.mjs`);
await finish();
