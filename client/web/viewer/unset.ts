// What a field that a scene leaves unset means: a change of a running world can set a field, but not unset it.
import {
  Collision_Bounds,
  Collision_Soft,
  Gas_Law,
  PressureSpread,
  Stepping_Integrator,
  Stepping_OnUnstable,
  Volume_Method,
} from "../src/index.js";

/** Of a gas that says none. */
export const temperatureUnsetK = 293.15;

/** By the fields' names. Those that scene.proto tells no default of are 0. */
export const meaningOfUnset: Readonly<Record<string, unknown>> = {
  massKg: 1,
  stiffnessNM: 0,
  dampingNSM: 0,
  restScale: 1,
  bendStiffnessNM: 0,
  moles: 0,
  temperatureK: temperatureUnsetK,
  law: Gas_Law.ISOTHERMAL,
  heatCapacityRatio: 1.4,
  flowMolS: 0,
  leakMolSPa: 0,
  method: Volume_Method.EXACT,
  resolution: 0,
  pressureSpread: PressureSpread.FACES,
  thicknessM: 0,
  normal: 0,
  tangential: 0,
  soft: Collision_Soft.EXACT,
  self: false,
  bounds: Collision_Bounds.ELLIPSOID,
  rateHz: 60,
  substeps: 0,
  integrator: Stepping_Integrator.AUTO,
  errorTarget: 0.01,
  newtonIterations: 1,
  onUnstable: Stepping_OnUnstable.REFUSE,
  sleep: true,
};
