// Shows pneuma-sim from outside: what it writes is what the physics of a free fall asks for, the same on every run and
// with any number of threads, and everything that can go wrong gives the exit code and the one line that it should.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using support::Finished;
using support::run_program;
using support::TemporaryFolder;

constexpr std::chrono::seconds run_patience{60};

Finished sim(const std::vector<std::string>& arguments) {
  return run_program("pneuma-sim", arguments, {}, run_patience);
}

std::vector<std::string> split(const std::string& line, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

/// Exit status 1 and one line that says `says`.
void expect_failure(const std::vector<std::string>& arguments, const std::string& says) {
  const Finished finished = sim(arguments);
  EXPECT_EQ(finished.exit_status, 1) << says;
  EXPECT_EQ(std::count(finished.error_output.begin(), finished.error_output.end(), '\n'), 1) << finished.error_output;
  EXPECT_TRUE(finished.error_output.starts_with("pneuma-sim: ")) << finished.error_output;
  EXPECT_NE(finished.error_output.find(says), std::string::npos) << finished.error_output;
}

class SimScene : public testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  TemporaryFolder folder_;
};

constexpr const char* falling_ball = R"({
  "gravity": {"y": -9.81},
  "stepping": {"rate_hz": 50, "substeps": 2},
  "meshes": [{"name": "ball", "icosphere": {"subdivisions": 1}}],
  "soft_bodies": [{"name": "a, \"b\"", "mesh": "ball", "mass_kg": 2, "velocity": {"x": 3}, "springs": {"stiffness_n_m": 1}}]})";

TEST_F(SimScene, CsvHoldsAFreeFallTickByTick) {
  const std::string csv = folder_ / "out.csv";
  const Finished finished = sim({file("fall.json", falling_ball), "--seconds", "1", "--csv", csv});
  ASSERT_EQ(finished.exit_status, 0) << finished.error_output;
  EXPECT_EQ(finished.output, "");
  const auto lines = lines_of(csv);
  ASSERT_EQ(lines.size(), 1U + 51U);  // the start, and 50 ticks
  EXPECT_EQ(lines[0],
            "tick,time_s,body,volume_m3,area_m2,pressure_pa,kinetic_j,elastic_j,gas_j,gravity_j,px,py,pz,lx,ly,lz,com_"
            "x,com_y,"
            "com_z,max_speed_m_s,temperature_k,moles");
  for (std::size_t tick = 0; tick <= 50; ++tick) {
    const std::string& line = lines[tick + 1];
    const std::string name = R"("a, ""b""")";
    ASSERT_NE(line.find(name), std::string::npos) << line;
    const auto before = split(line.substr(0, line.find(name)), ',');
    const auto after = split(line.substr(line.find(name) + name.size() + 1), ',');
    ASSERT_EQ(after.size(), 19U);
    const double time_s = static_cast<double>(tick) / 50;
    EXPECT_EQ(before[0], std::to_string(tick));
    EXPECT_NEAR(std::stod(before[1]), time_s, 1e-12);
    EXPECT_NEAR(std::stod(after[7]), 2.0 * 3.0, 1e-9);                       // px
    EXPECT_NEAR(std::stod(after[8]), -2.0 * 9.81 * time_s, 1e-9);            // py
    EXPECT_NEAR(std::stod(after[13]), 3.0 * time_s, 1e-9);                   // com_x
    EXPECT_NEAR(std::stod(after[14]), -0.5 * 9.81 * time_s * time_s, 1e-9);  // com_y; midpoint is exact for it
    const double kinetic_and_gravity_j = std::stod(after[3]) + std::stod(after[6]);
    EXPECT_NEAR(kinetic_and_gravity_j, 0.5 * 2.0 * 9.0, 1e-9);
  }
}

TEST_F(SimScene, CsvOnStandardOutputIsTheRowsAlone) {
  const std::string scene = file("fall.json", falling_ball);
  ASSERT_EQ(sim({scene, "--seconds", "0.5", "--csv", folder_ / "out.csv"}).exit_status, 0);
  const Finished piped = sim({scene, "--seconds", "0.5", "--csv", "-", "--hash"});
  EXPECT_EQ(piped.exit_status, 0) << piped.error_output;
  std::ifstream in(folder_ / "out.csv");
  const std::string rows((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_EQ(piped.output, rows);
  EXPECT_TRUE(piped.error_output.starts_with("hash 0x")) << piped.error_output;
}

TEST_F(SimScene, ObjFilesHoldTheShapeOfEachTick) {
  const Finished finished = sim({file("fall.json", falling_ball), "--seconds", "0.04", "--obj", folder_ / "shapes/of"});
  ASSERT_EQ(finished.exit_status, 0) << finished.error_output;
  for (const char* tick : {"000000", "000001", "000002"}) {
    const auto lines = lines_of(folder_ / ("shapes/of/0-a___b_-" + std::string(tick) + ".obj"));
    EXPECT_EQ(std::count_if(lines.begin(), lines.end(), [](const auto& line) { return line[0] == 'v'; }), 42);
    EXPECT_EQ(std::count_if(lines.begin(), lines.end(), [](const auto& line) { return line[0] == 'f'; }), 80);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "shapes/of/0-a___b_-000003.obj"));
}

TEST(SimProgram, TakesEveryIntegratorAndSaysWhichOneAutoPicked) {
  for (const std::string name :
       {"EXPLICIT_EULER", "MIDPOINT", "RK4", "SYMPLECTIC_EULER", "IMPLICIT_EULER", "TR_BDF2", "XPBD"}) {
    const Finished finished = sim({"bouncing-ball", "--seconds", "0.1", "--integrator", name, "--substeps", "64",
                                   "--set", "stepping.on_unstable=ALLOW"});
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    EXPECT_NE(finished.output.find(name + ", 64 substeps a tick"), std::string::npos) << finished.output;
  }
  const Finished picked =
      sim({"bouncing-ball", "--seconds", "0.1", "--substeps", "0", "--set", "stepping.integrator=AUTO"});
  EXPECT_EQ(picked.exit_status, 0) << picked.error_output;
  EXPECT_NE(picked.output.find(" costs least, about "), std::string::npos) << picked.output;
}

TEST(SimProgram, HashIsTheSameOnEveryRunWithAnyThreads) {
  const std::string first = sim({"five-balls", "--seconds", "2", "--hash"}).output;
  EXPECT_EQ(first.size(), std::string("hash 0x0123456789abcdef\n").size());
  EXPECT_EQ(first.substr(0, 7), "hash 0x");
  for (const char* threads : {"1", "2", "5"}) {
    EXPECT_EQ(sim({"five-balls", "--seconds", "2", "--hash", "--threads", threads}).output, first) << threads;
  }
  EXPECT_NE(sim({"five-balls", "--seconds", "2.1", "--hash"}).output, first);
}

TEST(SimProgram, HashIsTheSameOnEveryInstructionSet) {
  const auto run = [](const char* isa) { return sim({"five-balls", "--seconds", "0.5", "--hash", "--isa", isa}); };
  const std::string baseline = run("baseline").output;
  EXPECT_EQ(baseline.substr(0, 7), "hash 0x");
  for (const char* isa : {"v3", "v4"}) {
    const Finished finished = run(isa);
    if (finished.exit_status == 0) {
      EXPECT_EQ(finished.output, baseline) << isa;
    } else {  // a processor that lacks it
      EXPECT_EQ(finished.exit_status, 1);
      EXPECT_NE(finished.error_output.find("lacks"), std::string::npos) << finished.error_output;
    }
  }
}

TEST(SimProgram, FlagsOverrideTheScene) {
  const auto hash = [](std::vector<std::string> more) {
    more.insert(more.begin(), {"bouncing-ball", "--seconds", "0.5", "--hash"});
    const Finished finished = sim(more);
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    return finished.output;
  };
  const std::string plain = hash({});
  EXPECT_EQ(hash({"--integrator", "auto", "--precision", "single", "--substeps", "0"}), plain);
  EXPECT_EQ(hash({"--set", "stepping.substeps=0", "--set", "soft_bodies.ball.mass_kg=1"}), plain);
  EXPECT_NE(hash({"--integrator", "Midpoint"}), plain);
  EXPECT_NE(hash({"--precision", "DOUBLE"}), plain);
  EXPECT_NE(hash({"--substeps", "20"}), plain);
  EXPECT_NE(hash({"--set", "soft_bodies[0].gas.moles=0.02"}), plain);
}

constexpr const char* pinned_cloth = R"({
  "gravity": {"y": -9.81},
  "stepping": {"substeps": 16},
  "meshes": [{"name": "sheet", "grid": {"columns": 8, "rows": 8}}],
  "soft_bodies": [{"name": "cloth", "mesh": "sheet", "pin_boundary": true,
                   "springs": {"stiffness_n_m": 50, "damping_n_s_m": 2}}]})";

TEST_F(SimScene, ProfileShowsWhatAScenesPlanLeavesOut) {
  const auto stages = [](const std::string& scene) {
    std::map<std::string, std::vector<std::string>> rows;
    const Finished finished = sim({scene, "--seconds", "0.2", "--profile"});
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    for (const std::string& line : split(finished.output, '\n')) {
      std::istringstream words(line);
      std::string name;
      words >> name;
      for (std::string word; words >> word;) rows[name].push_back(word);
    }
    return rows;
  };
  const std::vector<std::string> absent{"0.000", "0", "0"};
  auto still = stages(file("cloth.json", pinned_cloth));
  for (const char* stage : {"bending", "volume", "pressure", "wind", "grabs", "joints", "bounds", "broad_phase",
                            "soft_contact", "solid_contact", "rigid"}) {
    EXPECT_EQ(still[stage], absent) << stage;
  }
  for (const char* stage : {"springs", "integrate"}) EXPECT_NE(still[stage], absent) << stage;
  auto cloth = stages("wind-cloth");
  EXPECT_EQ(cloth["stage"], (std::vector<std::string>{"time_ms", "calls", "bytes"}));
  EXPECT_EQ(cloth["pressure"], absent);
  EXPECT_EQ(cloth["soft_contact"], absent);
  EXPECT_NE(cloth["wind"], absent);
  EXPECT_NE(cloth["springs"], absent);
  auto ball = stages("bouncing-ball");
  EXPECT_EQ(ball["wind"], absent);
  EXPECT_NE(ball["pressure"], absent);
  EXPECT_NE(ball["solid_contact"], absent);
}

TEST_F(SimScene, BodiesAtRestSleepUnlessTheSceneSaysOtherwise) {
  const std::string scene = file("cloth.json", pinned_cloth);
  const Finished asleep = sim({scene, "--seconds", "20"});
  EXPECT_NE(asleep.output.find("  (asleep)\n"), std::string::npos) << asleep.output;
  const Finished awake = sim({scene, "--seconds", "20", "--set", "stepping.sleep=false"});
  EXPECT_EQ(awake.exit_status, 0) << awake.error_output;
  EXPECT_EQ(awake.output.find("asleep"), std::string::npos) << awake.output;
}

TEST(SimProgram, TenSecondsAreSimulatedWhereNobodySaysHowLong) {
  const Finished finished = sim({"bouncing-ball"});
  EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
  EXPECT_NE(finished.output.find("600 ticks, 10 s simulated"), std::string::npos) << finished.output;
}

TEST(SimProgram, EveryBuiltInSceneRunsAndSumsUp) {
  for (const char* scene :
       {"hero", "five-balls", "hanging-ball", "wind-cloth", "bouncing-ball", "hand", "cost-curve"}) {
    const Finished finished = sim({scene, "--seconds", "0.2"});
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    EXPECT_EQ(finished.error_output, "");  // no progress line where nobody watches
    EXPECT_NE(finished.output.find("12 ticks, 0.2 s simulated"), std::string::npos) << finished.output;
    EXPECT_NE(finished.output.find("times real time"), std::string::npos);
  }
}

// Of the hand's volume, an unstretched skin holds 0.343 l.
TEST(SimProgram, EveryVolumeMethodHoldsTheHandsGas) {
  for (const char* method : {"EXACT", "BOX", "BALL", "ELLIPSOID", "SUBDIVIDED", "MONTE_CARLO"}) {
    const Finished finished =
        sim({"hand", "--seconds", "0.2", "--csv", "-", "--set", std::string("soft_bodies[0].volume.method=") + method});
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    const auto rows = split(finished.output, '\n');
    ASSERT_EQ(rows.size(), 14U) << method;
    const double volume_m3 = std::stod(split(rows[13], ',')[3]);
    EXPECT_GT(volume_m3, 1.5e-4) << method;
    EXPECT_LT(volume_m3, 4.5e-4) << method;
  }
}

TEST(SimProgram, VersionAndHelp) {
  const Finished version = sim({"--version"});
  EXPECT_EQ(version.exit_status, 0);
  EXPECT_TRUE(version.output.starts_with("pneuma-sim ")) << version.output;
  const Finished help = sim({"--help"});
  EXPECT_EQ(help.exit_status, 0);
  for (const char* flag : {"--seconds", "--integrator", "--substeps", "--precision", "--threads", "--csv", "--obj",
                           "--hash", "--profile", "--set", "--isa", "five-balls"}) {
    EXPECT_NE(help.output.find(flag), std::string::npos) << flag;
  }
}

TEST(SimProgram, BadUsageExitsTwo) {
  const std::vector<std::vector<std::string>> bad{{},
                                                  {"--seconds", "1"},
                                                  {"five-balls", "--seconds", "-1"},
                                                  {"five-balls", "--seconds", "nan"},
                                                  {"five-balls", "--seconds", "long"},
                                                  {"five-balls", "--seconds", "1", "--integrator", "LEAPFROG"},
                                                  {"five-balls", "--seconds", "1", "--precision", "half"},
                                                  {"five-balls", "--seconds", "1", "--threads", "0"},
                                                  {"five-balls", "--seconds", "1", "--isa", "v5"},
                                                  {"five-balls", "--seconds", "1", "--substeps", "-1"},
                                                  {"five-balls", "--seconds", "1", "--substeps", "99999"},
                                                  {"five-balls", "--seconds", "1", "--integrator", ""},
                                                  {"five-balls", "--seconds", "1", "--integrator", "3"},
                                                  {"five-balls", "--seconds", "1", "--csv", ""},
                                                  {"five-balls", "--seconds", "1", "--obj", ""},
                                                  {"", "--seconds", "1"},
                                                  {"five-balls", "--seconds", "1", "--set", "no assignment"},
                                                  {"five-balls", "--seconds", "1", "--set", "=1"},
                                                  {"five-balls", "hand", "--seconds", "1"},
                                                  {"five-balls", "--seconds", "1", "--no-such-flag"}};
  for (const auto& arguments : bad) {
    const Finished finished = sim(arguments);
    EXPECT_EQ(finished.exit_status, 2) << ::testing::PrintToString(arguments);
    EXPECT_EQ(std::count(finished.error_output.begin(), finished.error_output.end(), '\n'), 1) << finished.error_output;
  }
}

TEST_F(SimScene, BadScenesExitOneWithTheFieldFaceOrVertex) {
  const auto refused = [this](const std::string& text, const std::string& says) {
    const std::string path = file("bad.json", text);
    expect_failure({path, "--seconds", "1"}, says);
    expect_failure({path, "--seconds", "1"}, path + ": ");
  };
  const std::string body = R"("soft_bodies": [{"name": "b", "mesh": "m")";
  const std::string ball = R"({"meshes": [{"name": "m", "icosphere": {"subdivisions": 1}}], )" + body;
  const auto triangles = [](const std::string& indices) {
    return R"({"meshes": [{"name": "m", "triangles": {"positions": [{}, {"x": 1}, {"y": 1}, {"z": 1}], "indices": [)" +
           indices + "]}}], ";
  };
  refused(R"({"gravty": {}})", "gravty: unknown field; did you mean gravity?");
  refused(R"({"name": 1})", "name: is a number");
  refused("{" + body + "}]}", "soft_bodies[0].mesh: no mesh is named \"m\"");
  refused(ball + R"(, "mass_kg": -1}]})", "soft_bodies[0].mass_kg");
  refused(ball + R"(, "velocity": {"x": "NaN"}}]})", "soft_bodies[0].velocity.x: is not finite");
  refused(ball + R"(, "pins": [42]}]})", "soft_bodies[0].pins[0]");
  refused(triangles("0, 1, 9") + body + "}]}", "meshes[0].triangles.indices[0..2]: face 0 names vertex 9");
  refused(triangles("0, 2, 1, 0, 0, 3") + body + "}]}",
          "meshes[0].triangles.indices[3..5]: face 1 names vertex 0 twice");
  refused(triangles("0, 2, 1, 0, 1, 3, 0, 3, 2") + body + R"(, "gas": {"moles": 1}}]})", "is open");
  refused(ball + R"(, "volume": {"method": "SUBDIVIDED", "resolution": 129}}]})",
          "soft_bodies[0].volume.resolution: is 129; its magnitude may be at most 128");
}

TEST_F(SimScene, WhatCannotBeReadOrWrittenExitsOneAndIsNamed) {
  const std::string no_json = file("no.json", "{\n  \"name\" 1}");
  expect_failure({no_json, "--seconds", "1"}, no_json + ":2:10: no valid JSON");
  expect_failure({"five-bals", "--seconds", "1"}, "five-bals: no such scene file");
  expect_failure({"five-bals", "--seconds", "1"}, "five-balls");
  expect_failure({"five-balls", "--seconds", "1", "--csv", "/no/such/folder/out.csv"},
                 "/no/such/folder/out.csv: cannot write");
  expect_failure({"five-balls", "--seconds", "1", "--csv", "/dev/full"},
                 "/dev/full: cannot write: No space left on device");
  expect_failure({"five-balls", "--seconds", "1", "--obj", "/dev/null/x"}, "/dev/null/x: cannot make the folder");
  expect_failure({"five-balls", "--seconds", "1", "--set", "soft_bodies.ball-9.mass_kg=1"},
                 "pneuma-sim: soft_bodies.ball-9: nothing is named \"ball-9\"");
  expect_failure({"five-balls", "--seconds", "1", "--integrator", "midpoint", "--substeps", "1"},
                 "five-balls: stepping.substeps: 1 are too few: ");
}

TEST_F(SimScene, RunawayBodyIsNamedAndTheOthersGoOn) {
  const std::string scene = file("runaway.json", R"({
    "stepping": {"substeps": 1, "integrator": "EXPLICIT_EULER", "on_unstable": "ALLOW"},
    "meshes": [{"name": "ball", "icosphere": {"subdivisions": 1}}],
    "soft_bodies": [
      {"name": "wild", "mesh": "ball", "springs": {"stiffness_n_m": 1e8, "rest_scale": 1.01}},
      {"name": "calm", "mesh": "ball", "position": {"x": 5}, "velocity": {"y": 1}, "collision": {"soft": "NONE"}}]})");
  const Finished finished = sim({scene, "--seconds", "2", "--csv", folder_ / "out.csv"});
  EXPECT_EQ(finished.exit_status, 1);
  const auto told = split(finished.error_output, '\n');
  ASSERT_EQ(told.size(), 2U) << finished.error_output;
  EXPECT_TRUE(told[0].starts_with("tick ")) << told[0];
  EXPECT_NE(told[0].find(": body \"wild\" frozen: "), std::string::npos) << told[0];
  EXPECT_TRUE(told[1].starts_with("pneuma-sim: body \"wild\": was frozen at tick ")) << told[1];
  const auto last = split(lines_of(folder_ / "out.csv").back(), ',');
  EXPECT_EQ(last[2], "calm");
  EXPECT_NEAR(std::stod(last[17]), 2.0, 1e-9);
}

TEST_F(SimScene, MendedMeshIsTold) {
  const std::string scene = file("open.json", R"({
    "meshes": [{"name": "m", "mend": {}, "triangles": {"positions": [{}, {"x": 1}, {"y": 1}, {"z": 1}],
                "indices": [0, 2, 1, 0, 1, 3, 0, 3, 2]}}],
    "soft_bodies": [{"name": "b", "mesh": "m", "gas": {"moles": 0.001}}]})");
  const Finished finished = sim({scene, "--seconds", "0.1"});
  EXPECT_EQ(finished.exit_status, 0);
  EXPECT_EQ(finished.error_output, "mesh \"m\" mended: 1 hole closed with 1 face\n");
}

TEST_F(SimScene, BurstIsToldWithItsTickBodyAndPressure) {
  const std::string scene = file("burst.json", R"({
    "meshes": [{"name": "ball", "icosphere": {"subdivisions": 1}}],
    "soft_bodies": [{"name": "thin", "mesh": "ball", "springs": {"stiffness_n_m": 10},
                     "gas": {"moles": 0.01, "burst_pressure_pa": 1}}]})");
  const Finished finished = sim({scene, "--seconds", "1"});
  EXPECT_EQ(finished.exit_status, 0);
  EXPECT_TRUE(finished.error_output.starts_with("tick 1: body \"thin\" burst: ")) << finished.error_output;
  EXPECT_NE(finished.error_output.find(" Pa over the outside at "), std::string::npos) << finished.error_output;
  EXPECT_EQ(split(finished.error_output, '\n').size(), 1U);
}

}  // namespace
}  // namespace pneuma::integration
