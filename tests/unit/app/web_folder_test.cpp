// Shows which files of a folder are served, and under which paths: a folder as npm's tools leave it, a mount whose
// files are links, and folders that are refused with the name of the file.
#include "app/web_folder.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

namespace fs = std::filesystem;

class WebFolderFiles : public testing::Test {
 protected:
  WebFolderFiles() { write("web/index.html", "the page"); }

  void write(const std::string& name, const std::string& content) {
    fs::create_directories(fs::path(folder_ / name).parent_path());
    std::ofstream(folder_ / name) << content;
  }
  void link(const std::string& target, const std::string& name) { fs::create_symlink(target, folder_ / name); }

  // What is served at a path; "none".
  static std::string at(const base::Result<WebFolder>& web, const std::string& path) {
    const net::HttpReply* file = web->find(path);
    return file == nullptr ? "none" : *file->body;
  }
  void expect_refused(const std::string& name) {
    const auto web = WebFolder::load(folder_ / "web");
    ASSERT_FALSE(web.ok());
    EXPECT_EQ(web.status().where(), folder_ / name) << web.status().message();
  }

  support::TemporaryFolder folder_;
};

TEST_F(WebFolderFiles, EachIsServedAtItsPathFromTheFolder) {
  write("web/assets/app.js", "code");
  write("web/assets/app.js.gz", "compressed");
  write("web/alone.js.gz", "compressed");
  for (const char* name : {"web", "web/", "web/assets/.."}) {
    const auto web = WebFolder::load(folder_ / name);
    ASSERT_TRUE(web.ok()) << web.status().message();
    EXPECT_EQ(at(web, "/"), "the page") << name;
    EXPECT_EQ(at(web, "/index.html"), "the page") << name;
    EXPECT_EQ(at(web, "/assets/app.js"), "code") << name;
    EXPECT_EQ(*web->find("/assets/app.js")->gzip_body, "compressed") << name;
    EXPECT_EQ(at(web, "/alone.js"), "none") << "compressed alone";
    EXPECT_EQ(at(web, "/assets"), "none");
  }
}

TEST_F(WebFolderFiles, AMountOfLinksIsServedUnderTheNamesOfTheLinks) {
  write("mount/..2026_01_01/index.html", "the page");
  write("mount/..2026_01_01/app.js", "code");
  link("..2026_01_01", "mount/..data");
  link("..data/index.html", "mount/index.html");
  link("..data/app.js", "mount/app.js");
  link("mount", "link");
  for (const char* name : {"mount", "link"}) {
    const auto web = WebFolder::load(folder_ / name);
    ASSERT_TRUE(web.ok()) << web.status().message();
    EXPECT_EQ(at(web, "/"), "the page");
    EXPECT_EQ(at(web, "/app.js"), "code");
    EXPECT_EQ(at(web, "/..data/app.js"), "none");
    EXPECT_EQ(at(web, "/..2026_01_01/app.js"), "none");
  }
}

TEST_F(WebFolderFiles, WhatIsHiddenIsNotServed) {
  write("web/.git/config", "not of a type that is served");
  write("web/.secret.txt", "secret");
  const auto web = WebFolder::load(folder_ / "web");
  ASSERT_TRUE(web.ok()) << web.status().message();
  EXPECT_EQ(at(web, "/.secret.txt"), "none");
}

TEST_F(WebFolderFiles, ALinkToAFolderIsPassedOver) {
  write("elsewhere/app.js", "code");
  link(folder_ / "elsewhere", "web/assets");
  const auto web = WebFolder::load(folder_ / "web");
  ASSERT_TRUE(web.ok()) << web.status().message();
  EXPECT_EQ(at(web, "/assets/app.js"), "none");
}

TEST_F(WebFolderFiles, ALinkOutOfTheFolderIsRefused) {
  write("secret.txt", "secret");
  link("../secret.txt", "web/notes.txt");
  expect_refused("web/notes.txt");
}

TEST_F(WebFolderFiles, ALinkToNowhereIsRefused) {
  link("gone.js", "web/app.js");
  expect_refused("web/app.js");
}

TEST_F(WebFolderFiles, ATypeThatIsNotServedIsRefused) {
  write("web/program.exe", "");
  expect_refused("web/program.exe");
}

TEST_F(WebFolderFiles, AFolderWithoutIndexOrNoneAtAllIsRefused) {
  fs::remove(folder_ / "web/index.html");
  expect_refused("web");
  fs::remove(folder_ / "web");
  expect_refused("web");
}

}  // namespace
}  // namespace pneuma::app
