// What the client takes of Node.js; the package @types/node has all of it.
declare module "node:fs" {
  export function readFileSync(path: string, encoding: "utf-8"): string;
}
declare const process: { argv: string[]; exit(status: number): never };
