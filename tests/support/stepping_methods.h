// Every way to step a scene, for tests with a parameter.
#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/choice/step_choice.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

struct SteppingMethod {
  Integrator integrator;
  Precision precision;
};

/// For the name of a test: "RK4_SINGLE".
inline std::string name_of_stepping_method(const testing::TestParamInfo<SteppingMethod>& param) {
  return std::string(name_of(param.param.integrator)) +
         (param.param.precision == Precision::single_precision ? "_SINGLE" : "_DOUBLE");
}

/// Each integrator in both precisions.
inline std::vector<SteppingMethod> every_stepping_method() {
  std::vector<SteppingMethod> all;
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    for (const Integrator integrator :
         {Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler,
          Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd}) {
      all.push_back({integrator, precision});
    }
  }
  return all;
}

}  // namespace pneuma::physics
