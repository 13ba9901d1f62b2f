// Shows that one process at a time owns a data folder, that any name of a world is a safe file name, and that removing
// a world leaves nothing.
#include "persist/data_dir.h"

#include <filesystem>
#include <fstream>
#include <string_view>

#include <gtest/gtest.h>

#include "persist/checkpoint.h"
#include "persist/command_log.h"
#include "persist/world_files.h"
#include "support/temporary_folder.h"

namespace pneuma::persist {
namespace {

namespace fs = std::filesystem;

TEST(DataDir, IsMadeWithItsParents) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(DataDir::open(folder / "a/b").ok());
  EXPECT_TRUE(fs::is_directory(folder / "a/b"));
}

TEST(DataDir, SecondOwnerIsRefusedUntilTheFirstIsGone) {
  const support::TemporaryFolder folder;
  {
    const auto first = DataDir::open(folder.path());
    ASSERT_TRUE(first.ok());
    const auto second = DataDir::open(folder.path());
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.status().code(), base::StatusCode::failed_precondition);
    EXPECT_NE(second.status().message().find("another server"), std::string::npos);
  }
  EXPECT_TRUE(DataDir::open(folder.path()).ok());
}

TEST(DataDir, MovedOwnerKeepsTheLock) {
  const support::TemporaryFolder folder;
  auto first = DataDir::open(folder.path());
  ASSERT_TRUE(first.ok());
  const DataDir moved = std::move(*first);
  EXPECT_FALSE(DataDir::open(folder.path()).ok());
}

TEST(DataDir, FolderThatCannotBeMadeIsNamed) {
  const auto opened = DataDir::open("/dev/null/data");
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.status().where(), "/dev/null/data");
}

TEST(WorldNames, AnyNameRoundTripsAsOneVisibleComponent) {
  for (const std::string& name :
       {std::string("five-balls-2"), std::string("../../etc/passwd"), std::string(".hidden"), std::string("a b/c%d"),
        std::string("B\xc3\xa4lle"), std::string("nul\0inside", 10)}) {
    const std::string component = encode_name(name);
    EXPECT_EQ(component.find('/'), std::string::npos) << component;
    EXPECT_EQ(component.find('\0'), std::string::npos) << component;
    EXPECT_NE(component.front(), '.') << component;
    EXPECT_EQ(decode_name(component), name);
  }
}

TEST(WorldNames, WhatNobodyEncodedIsNoWorld) {
  for (const char* component : {"%", "%4", "%zz", "%41", "a b", "%2e", ".removed-x"}) {
    EXPECT_EQ(decode_name(component), "") << component;
  }
}

TEST(WorldNames, EmptyAndOverlongNamesAreRefused) {
  const support::TemporaryFolder folder;
  const auto data_dir = DataDir::open(folder.path());
  ASSERT_TRUE(data_dir.ok());
  EXPECT_EQ(data_dir->world_folder("").status().code(), base::StatusCode::invalid_argument);
  EXPECT_EQ(data_dir->world_folder(std::string(128, '/')).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(data_dir->world_folder(std::string(128, 'x')).ok());
}

TEST(DataDir, ListsAndRemovesWorlds) {
  const support::TemporaryFolder folder;
  const auto data_dir = DataDir::open(folder.path());
  ASSERT_TRUE(data_dir.ok());
  ASSERT_TRUE(write_checkpoint(*data_dir, "b/1", {0, 5, "x"}).ok());
  ASSERT_TRUE(write_checkpoint(*data_dir, "a", {0, 5, "y"}).ok());
  EXPECT_EQ(*data_dir->list_worlds(), (std::vector<std::string>{"a", "b/1"}));
  EXPECT_TRUE(data_dir->remove_world("b/1").ok());
  EXPECT_EQ(*data_dir->list_worlds(), std::vector<std::string>{"a"});
  EXPECT_EQ(read_latest_checkpoint(*data_dir, "b/1").status().code(), base::StatusCode::not_found);
  EXPECT_TRUE(data_dir->remove_world("never was").ok());
}

TEST(DataDir, HalfRemovedWorldIsSweptOnOpen) {
  const support::TemporaryFolder folder;
  fs::create_directories(folder / "worlds/.removed-a");
  {
    std::FILE* file = std::fopen((folder / "worlds/.removed-a/log-1").c_str(), "w");
    std::fclose(file);
  }
  const auto data_dir = DataDir::open(folder.path());
  ASSERT_TRUE(data_dir.ok());
  EXPECT_TRUE(data_dir->list_worlds()->empty());
  EXPECT_FALSE(fs::exists(folder / "worlds/.removed-a"));
}

// What is not the server's own is neither removed nor in the way.
TEST(DataDir, LeavesAFolderWithinAWorldsAlone) {
  const support::TemporaryFolder folder;
  {
    const auto data_dir = DataDir::open(folder.path());
    ASSERT_TRUE(data_dir.ok());
    ASSERT_TRUE(write_checkpoint(*data_dir, "a", {0, 5, "x"}).ok());
    fs::create_directories(folder / "worlds/a/lost+found");
    const base::Status removed = data_dir->remove_world("a");
    EXPECT_EQ(removed.code(), base::StatusCode::failed_precondition);
    EXPECT_EQ(removed.where(), folder / "worlds/a/lost+found");
    EXPECT_TRUE(read_latest_checkpoint(*data_dir, "a").ok());
  }
  fs::rename(folder / "worlds/a", folder / "worlds/.removed-a");
  const auto again = DataDir::open(folder.path());
  ASSERT_TRUE(again.ok());
  ASSERT_EQ(again->left().size(), 1U);
  EXPECT_EQ(again->left()[0].where(), folder / "worlds/.removed-a/lost+found");
}

TEST(DataDir, OfALinkRemovesTheLinkAlone) {
  const support::TemporaryFolder folder;
  const support::TemporaryFolder elsewhere;
  fs::create_directories(elsewhere / "a");
  std::ofstream(elsewhere / "a/precious") << "kept";
  fs::create_directories(folder / "worlds");
  fs::create_directory_symlink(elsewhere / "a", folder / "worlds/a");
  fs::create_directory_symlink(elsewhere / "a", folder / "worlds/.removed-b");
  fs::create_directory_symlink(elsewhere / "nowhere", folder / "worlds/.removed-c");
  const auto data_dir = DataDir::open(folder.path());
  ASSERT_TRUE(data_dir.ok());
  EXPECT_TRUE(data_dir->left().empty());
  EXPECT_TRUE(data_dir->remove_world("a").ok());
  EXPECT_TRUE(fs::is_empty(folder / "worlds"));
  EXPECT_TRUE(fs::exists(elsewhere / "a/precious"));
}

// Nobody was told of it; so its name is free.
TEST(DataDir, AWorldThatWasBeingMadeIsSweptOnOpen) {
  const support::TemporaryFolder folder;
  {
    const auto data_dir = DataDir::open(folder.path());
    ASSERT_TRUE(data_dir.ok());
    for (const char* world : {"begun", "log lost", "log kept", "whole"}) {
      auto log = CommandLog::start(*data_dir, world, 0, Sync::none);
      ASSERT_TRUE(log.ok());
      if (std::string_view(world) == "log kept") {
        ASSERT_TRUE(log->write(1, "asked for").ok());
      }
    }
    ASSERT_TRUE(write_checkpoint(*data_dir, "whole", {0, 5, "x"}).ok());
    std::ofstream(*data_dir->world_folder("begun") + "/unfinished") << "half a checkpoint";
    std::ofstream(*data_dir->world_folder("log lost") + "/checkpoint-00000000000000000000") << "damaged";
  }
  const auto data_dir = DataDir::open(folder.path());
  ASSERT_TRUE(data_dir.ok());
  EXPECT_EQ(*data_dir->list_worlds(), (std::vector<std::string>{"log kept", "log lost", "whole"}));
}

}  // namespace
}  // namespace pneuma::persist
