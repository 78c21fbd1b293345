#!/usr/bin/env node
// Runs the program, which npm installed with the package of this platform.
const { spawn } = require("node:child_process");
const { constants } = require("node:os");

const platform = `${process.platform}-${process.arch}`;
let program;
try {
    program = require.resolve(`@specula/${platform}/specula${process.platform === "win32" ? ".exe" : ""}`);
} catch {
    console.error(`error: there is no package @specula/${platform} here; it exists for linux-x64, linux-arm64 and win32-x64`);
    console.error("hint: install without --omit=optional, or compile from the source");
    process.exit(1);
}
const child = spawn(program, process.argv.slice(2), { stdio: "inherit" });
// A terminal sends SIGINT to both, and the program ends in its own time; SIGTERM comes to this process alone.
process.on("SIGINT", () => {});
process.on("SIGTERM", () => child.kill("SIGTERM"));
child.on("error", (error) => {
    console.error(`error: cannot run ${program}: ${error.message}`);
    process.exit(1);
});
child.on("exit", (code, signal) => process.exit(code ?? 128 + constants.signals[signal]));
