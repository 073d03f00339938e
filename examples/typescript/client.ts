/* Asks a running service for its health, a plan and set-points, with zenoh-ts alone.
 *
 *   npm install && npm run build
 *   npm start -- ws/127.0.0.1:10000 ../../service/examples/wall-300.json
 *
 * The first argument is the WebSocket of zenoh's remote-api plugin, the second a request.
 */

import { readFileSync } from "node:fs";
import { Config, Encoding, Priority, ReplyError, Sample, Session } from "@eclipse-zenoh/zenoh-ts";

const KEY = "crux/robosimian";
const PATIENCE = 15_000; // [ms]
const STEPS = 20;
const PERIOD = 50; // of the wrenches that are published [ms]
const SWAY = 8; // how much the force up the wall sways [N]
const FINGERS = ["outer_left", "inner_left", "inner_right", "outer_right"];

type ErrorDetail = { kind: string; field: string | null; message: string };
type Health = { robot: string; version: string | null; uptime: number; processes: object[] };
type Hand = { limb: string; tensions: number[]; utilisation?: number };
type Answer = {
  status: string;
  reason: string | null;
  utilisation: number | null;
  hands: Hand[] | null;
};
type Plan = Answer & { load_factor: number | null };
type Stream = { stream: string; body_wrench: [number, ...number[]] };
type Published = {
  number: number | null;
  skipped: number;
  set_points: Answer | null;
  error: ErrorDetail | null;
};

const told = (error: ErrorDetail): string =>
  [error.kind, error.field, error.message].filter((part) => part !== null).join(": ");

const read = <T>(message: Sample | ReplyError): T => JSON.parse(message.payload().toString());

const sleep = (time: number): Promise<void> => new Promise((done) => setTimeout(done, time));

/** Wait no longer than PATIENCE. */
function within<T>(waited: Promise<T>, missing: string): Promise<T> {
  const late = sleep(PATIENCE).then(() => Promise.reject(new Error(missing)));
  return Promise.race([waited, late]);
}

/** Return the reply to one question; an error of the service is thrown. */
async function ask<T>(session: Session, name: string, message?: object): Promise<T> {
  const options = { payload: JSON.stringify(message), encoding: Encoding.APPLICATION_JSON };
  const replies = await session.get(`${KEY}/${name}`, message ? options : {});
  for await (const reply of replies ?? []) {
    const result = reply.result();
    if (result instanceof Sample) return read<T>(result);
    const json = result.encoding().toString().startsWith("application/json");
    // an error of zenoh's own is plain text
    throw new Error(
      json ? told(read<{ error: ErrorDetail }>(result).error) : result.payload().toString(),
    );
  }
  throw new Error(`no service answers at ${KEY}/${name}: is crux serve there?`);
}

function row(name: string, cells: (number | string)[]): string {
  const shown = cells.map((cell) => (typeof cell === "number" ? cell.toFixed(1) : cell));
  return name.padEnd(12) + shown.map((cell) => cell.padStart(12)).join("");
}

/** Publish wrenches at a fixed rate, as a control loop does, and print set-points as they come. */
async function follow(session: Session, stance: object): Promise<void> {
  const stream = await ask<Stream>(session, "stream", { v: 1, stance });
  const [fx, ...others] = stream.body_wrench; // x of B is up the wall
  const key = `${KEY}/stream/${stream.stream}`;
  const last = new Promise<void>((done, fail) => {
    const handler = (sample: Sample): void => {
      const { number, skipped, set_points: points, error } = read<Published>(sample);
      const first = points?.hands?.[0];
      if (error?.field === "stream") fail(new Error(told(error)));
      // without set-points, a controller keeps those of before
      else if (error) console.log(`${number} ${told(error)}`);
      else if (!first) console.log(`${number} ${points?.status}: ${points?.reason}`);
      else console.log(row(`${number} ${first.limb}`, first.tensions), ` skipped ${skipped}`);
      if (number === STEPS - 1) done();
    };
    session.declareSubscriber(`${key}/set_points`, { handler }).catch(fail);
  });
  const publisher = await session.declarePublisher(`${key}/wrench`, {
    encoding: Encoding.APPLICATION_JSON,
    priority: Priority.REAL_TIME,
    express: true,
  });
  const publish = async (): Promise<void> => {
    for (let number = 0; number < STEPS; number++) {
      const body_wrench = [fx + SWAY * Math.sin((2 * Math.PI * number) / STEPS), ...others];
      const wrench = { v: 1, number, time: Date.now() / 1e3, body_wrench, detail: "set_points" };
      await publisher.put(JSON.stringify(wrench));
      await sleep(PERIOD);
    }
  };
  await Promise.all([publish(), within(last, "no set-points came for the last wrench")]);
}

async function main(locator: string, file: string): Promise<void> {
  const request = JSON.parse(readFileSync(file, "utf-8"));
  // by itself, zenoh-ts tries for half an hour
  const session = await within(
    Session.open(new Config(locator, PATIENCE)),
    `no remote-api plugin of zenoh answers at ${locator}`,
  );
  const health = await ask<Health>(session, "health");
  console.log(`${health.robot}: crux ${health.version}, ${health.processes.length} processes`);
  const asked = { ...request, detail: "hands", want: ["load_factor"] };
  const plan = await ask<Plan>(session, "plan", asked);
  if (!plan.hands) throw new Error(`${plan.status}: ${plan.reason}`);
  console.log(row("tension [N]", [...FINGERS, "utilisation"]));
  for (const { limb, tensions, utilisation } of plan.hands) {
    console.log(row(limb, [...tensions, utilisation?.toFixed(3) ?? ""]));
  }
  const margin = `utilisation ${plan.utilisation?.toFixed(3)}`;
  console.log(`${plan.status}: ${margin}, load factor ${plan.load_factor?.toFixed(3) ?? "none"}`);
  await follow(session, request.stance);
  await session.close();
}

const [locator, file] = process.argv.slice(2);
try {
  if (!locator || !file) throw new Error("usage: npm start -- ws/127.0.0.1:10000 STANCE.json");
  await main(locator, file);
  process.exit(0);
} catch (error) {
  console.error(error instanceof Error ? error.message : error);
  process.exit(1);
}
