// Shows that what a recording is exported to reads back as the recording: each format's own structure, its rate, and
// the vertices at every sample. The readers are the test's own.
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "formats/exporter.h"
#include "pneuma_client/playback.h"
#include "support/temporary_folder.h"
#include "unit/client/command_runner.h"
#include "unit/client/recorded.h"

namespace pneuma::client {
namespace {

constexpr std::uint64_t frames = 13;
constexpr double step_m = 1e-3;  // that every coordinate goes a frame

template <class Number>
Number number_at(const std::string& bytes, std::size_t offset) {
  Number number{};
  EXPECT_LE(offset + sizeof(Number), bytes.size());
  std::memcpy(&number, bytes.data() + offset, sizeof(Number));
  return number;
}

class Export : public testing::Test {
 protected:
  void SetUp() override { write_recording(file_, frames, 5); }

  support::Finished run_export(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"export", file_, "--out", out_});
    return support::run_program("pneuma", arguments);
  }

  support::TemporaryFolder folder_;
  std::string file_ = folder_ / "w.pneuma";
  std::string out_ = folder_ / "out";
};

TEST_F(Export, ObjIsAFileAFrame) {
  EXPECT_EQ(run_export({"--format", "obj"}).exit_status, 0);
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(out_)) ++count;
  EXPECT_EQ(count, frames);
  EXPECT_EQ(contents(out_ + "/frame-000004.obj"),
            "o ball\nv 0.005 0.005 0.005\nv 1.005 0.005 0.005\nv 0.005 1.005 0.005\nv 0.005 0.005 1.005\n"
            "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
}

TEST_F(Export, ShorterObjExportLeavesNoFramesOfALongerOne) {
  ASSERT_EQ(run_export({"--format", "obj"}).exit_status, 0);
  const std::string other = out_ + "/notes.txt";
  std::ofstream(other) << "mine";
  ASSERT_EQ(run_export({"--format", "obj", "--force", "--to", "0.05"}).exit_status, 0);
  EXPECT_TRUE(std::filesystem::exists(out_ + "/frame-000003.obj"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/frame-000004.obj"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/frame-000012.obj"));
  EXPECT_TRUE(std::filesystem::exists(other));
}

TEST_F(Export, Pc2HoldsEveryVertexOfEverySample) {
  EXPECT_EQ(run_export({"--format", "pc2"}).exit_status, 0);
  const std::string bytes = contents(out_ + "/ball.pc2");
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(number_at<std::int32_t>(bytes, 12), 1);
  EXPECT_EQ(number_at<std::int32_t>(bytes, 16), 4);
  EXPECT_EQ(number_at<float>(bytes, 20), 0.0F);
  EXPECT_EQ(number_at<float>(bytes, 24), 1.0F);
  ASSERT_EQ(number_at<std::int32_t>(bytes, 28), static_cast<std::int32_t>(frames));
  ASSERT_EQ(bytes.size(), 32 + frames * 4 * 3 * sizeof(float));
  for (std::uint64_t sample = 0; sample < frames; ++sample) {
    const float x = number_at<float>(bytes, 32 + sample * 48);
    EXPECT_FLOAT_EQ(x, static_cast<float>(step_m * static_cast<double>(sample + 1)));
  }
  EXPECT_NE(contents(out_ + "/ball.obj").find("f 2 3 4\n"), std::string::npos);
}

TEST_F(Export, UsdaHasATimeSampleAFrameAndTheRate) {
  EXPECT_EQ(run_export({"--format", "usda"}).exit_status, 0);
  const std::string text = contents(out_);
  for (const char* part : {"#usda 1.0\n", "upAxis = \"Y\"", "metersPerUnit = 1\n", "timeCodesPerSecond = 60\n",
                           "endTimeCode = 12\n", "def Mesh \"ball\"", "faceVertexCounts = [3, 3, 3, 3]",
                           "faceVertexIndices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]",
                           "  0: [(0.001, 0.001, 0.001), (1.001, 0.001, 0.001),", "  12: [(0.013, 0.013, 0.013),"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(std::ranges::count(text, '{'), std::ranges::count(text, '}'));
}

TEST_F(Export, GltfMovesEachVertexByItsTargets) {
  EXPECT_EQ(run_export({"--format", "gltf"}).exit_status, 0);
  const std::string bytes = contents(out_);
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 4), 2U);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 8), bytes.size());
  const auto json_bytes = number_at<std::uint32_t>(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(json_bytes % 4, 0U);
  const std::size_t numbers = 20 + json_bytes + 8;
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 20 + json_bytes), bytes.size() - numbers);
  EXPECT_EQ(bytes.substr(numbers - 4, 4), std::string("BIN\0", 4));

  const auto root = json(bytes.substr(20, json_bytes));
  const auto list = [&](const char* name) { return root.fields().at(name).list_value(); };
  const auto number = [](const auto& object, const char* name) {
    return static_cast<std::size_t>(object.fields().at(name).number_value());
  };
  const auto accessor = [&](std::size_t index) {
    return list("accessors").values(static_cast<int>(index)).struct_value();
  };
  const auto floats_at = [&](std::size_t index) {
    const auto view =
        list("bufferViews").values(static_cast<int>(number(accessor(index), "bufferView"))).struct_value();
    return numbers + number(view, "byteOffset");
  };
  const auto mesh = list("meshes").values(0).struct_value();
  EXPECT_EQ(mesh.fields().at("name").string_value(), "ball");
  const auto primitive = mesh.fields().at("primitives").list_value().values(0).struct_value();
  const std::size_t base = number(primitive.fields().at("attributes").struct_value(), "POSITION");
  EXPECT_FLOAT_EQ(number_at<float>(bytes, floats_at(base)), 0.001F);
  EXPECT_EQ(number(accessor(base), "count"), 4U);
  const auto targets = primitive.fields().at("targets").list_value();
  ASSERT_EQ(targets.values_size(), static_cast<int>(frames) - 1);
  for (int i = 0; i < targets.values_size(); ++i) {
    const std::size_t target = number(targets.values(i).struct_value(), "POSITION");
    EXPECT_NEAR(number_at<float>(bytes, floats_at(target)), step_m * (i + 1), 1e-8);
  }

  const auto sampler =
      list("animations").values(0).struct_value().fields().at("samplers").list_value().values(0).struct_value();
  const std::size_t times = number(sampler, "input");
  EXPECT_FLOAT_EQ(number_at<float>(bytes, floats_at(times) + (frames - 1) * sizeof(float)), 12.0F / 60.0F);
  const auto weights = accessor(number(sampler, "output"));
  EXPECT_EQ(number(weights, "count"), frames * (frames - 1));
  const auto sparse = weights.fields().at("sparse").struct_value();
  ASSERT_EQ(number(sparse, "count"), frames - 1);
  const auto view = list("bufferViews")
                        .values(static_cast<int>(number(sparse.fields().at("indices").struct_value(), "bufferView")))
                        .struct_value();
  for (std::size_t i = 0; i + 1 < frames; ++i) {
    const auto place =
        number_at<std::uint32_t>(bytes, numbers + number(view, "byteOffset") + i * sizeof(std::uint32_t));
    EXPECT_EQ(place / (frames - 1), i + 1) << "the sample";
    EXPECT_EQ(place % (frames - 1), i) << "its target";
  }
}

TEST_F(Export, ARangeAndARateAreSampledBetweenFrames) {
  // From the frame of tick 4 to that of tick 7: 50 ms; a sample every 12.5 ms is one every three quarters of a frame.
  EXPECT_EQ(run_export({"--format", "pc2", "--from", "0.05", "--to", "0.1", "--rate", "80"}).exit_status, 0);
  const std::string bytes = contents(out_ + "/ball.pc2");
  ASSERT_EQ(number_at<std::int32_t>(bytes, 28), 5);
  for (std::size_t sample = 0; sample < 5; ++sample) {
    const double tick = 4.0 + 0.75 * static_cast<double>(sample);
    EXPECT_NEAR(number_at<float>(bytes, 32 + sample * 48), step_m * tick, 1e-7);
  }
}

TEST_F(Export, WhatIsNotThereIsRefused) {
  const auto refused = run_export({"--format", "obj", "--body", "nobody"});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_NE(refused.error_output.find("nobody"), std::string::npos) << refused.error_output;
  EXPECT_EQ(run_export({"--format", "obj", "--from", "9"}).exit_status, 1);
  EXPECT_EQ(run_export({"--format", "obj", "--from", "0.1", "--to", "0.05"}).exit_status, 1);
  EXPECT_EQ(run_export({"--format", "abc"}).exit_status, 2);
}

TEST_F(Export, NothingThatIsThereIsLostUnasked) {
  const auto bytes = [](const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string recording = bytes(file_);
  for (const char* format : {"gltf", "usda", "obj", "pc2"}) {
    const auto refused =
        support::run_program("pneuma", {"export", file_, "--out", file_, "--force", "--format", format});
    EXPECT_EQ(refused.exit_status, 1) << format;
    EXPECT_EQ(bytes(file_), recording) << format;
  }
  ASSERT_EQ(run_export({"--format", "gltf"}).exit_status, 0);
  const std::string whole = bytes(out_);
  const auto refused = run_export({"--format", "usda"});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_NE(refused.error_output.find("is there already"), std::string::npos) << refused.error_output;
  EXPECT_EQ(bytes(out_), whole);
  EXPECT_EQ(run_export({"--format", "usda", "--force"}).exit_status, 0);
  EXPECT_NE(bytes(out_), whole);
}

TEST_F(Export, AFolderThatIsNotThereIsNamed) {
  const auto refused =
      support::run_program("pneuma", {"export", file_, "--format", "gltf", "--out", folder_ / "none" + "/a.glb"});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_NE(refused.error_output.find("no such folder"), std::string::npos) << refused.error_output;
}

// A second body comes in the middle.
TEST_F(Export, AChangeOfBodiesIsRefusedWhereTheFormatHasNone) {
  auto writer = RecordingWriter::create(file_, recording_header(), RecordingWriter::IfThere::replace);
  ASSERT_TRUE(writer.ok());
  write_frames(*writer, 6, 3);
  v1::ServerMessage layout = layout_message(recorded_stream, 2);
  *layout.mutable_layout()->mutable_soft_bodies(0)->mutable_name() = "other";
  append(*writer, layout);
  v1::ServerMessage key = key_frame(recorded_stream, 7, 7, 2);
  append(*writer, key);
  ASSERT_TRUE(writer->finish().ok());
  for (const char* format : {"gltf", "usda", "pc2"}) {
    const auto refused = run_export({"--format", format});
    EXPECT_EQ(refused.exit_status, 1);
    EXPECT_NE(refused.error_output.find("--to"), std::string::npos) << refused.error_output;
    std::filesystem::remove_all(out_);
    EXPECT_EQ(run_export({"--format", format, "--to", "0.08"}).exit_status, 0);
    std::filesystem::remove_all(out_);
  }
  EXPECT_EQ(run_export({"--format", "obj"}).exit_status, 0);
}

TEST(ExportNames, AreDifferentAndPlain) {
  std::vector<SoftBodyFrame> bodies(4);
  bodies[0].name = "ball-1";
  bodies[1].name = "ball 1";
  bodies[2].name = "ball_1";
  bodies[3].name = "1";
  EXPECT_EQ(file_names(bodies, ""), (std::vector<std::string>{"ball_1", "ball_1_2", "ball_1_3", "_1"}));
  EXPECT_EQ(file_names(bodies, "-"), (std::vector<std::string>{"ball-1", "ball_1", "ball_1_2", "_1"}));
}

}  // namespace
}  // namespace pneuma::client
