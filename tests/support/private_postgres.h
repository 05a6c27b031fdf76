// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "support/patience.h"

namespace truetriad {

/// A PostgreSQL server of this program alone: data, socket and log in a folder of its own, no
/// network. It ends with the program, however that ends.
class PrivatePostgres {
 public:
  /// The server of this program, started when first asked for. Null if PostgreSQL is not installed.
  static PrivatePostgres* Get() {
    static PrivatePostgres server;
    return server.folder_.empty() ? nullptr : &server;
  }

  /// The URL, for `--store=`, of a fresh database with a role that owns it and nothing else.
  std::string NewDatabase() {
    const std::string name = "line" + std::to_string(++databases_);
    EXPECT_EQ(Run("createdb", "-h '" + folder_ + "' -U postgres -O line " + name), 0);
    return "postgresql://line@/" + name + "?host=" + folder_;
  }
  /// The output of psql for the statements, which is only the rows of SELECT.
  std::string Psql(const std::string& url, const std::string& sql) const {
    return OutputOf(PsqlCommand(url, sql));
  }
  /// A shell command that prints this output.
  std::string PsqlCommand(const std::string& url, const std::string& sql) const {
    return "'" + Program("psql") + "' -qAtX '" + url + "' -c \"" + sql + "\" 2>&1";
  }

  void Start() const { EXPECT_EQ(Run("pg_ctl", Control("start")), 0) << Log(); }
  /// Stops as an administrator does: all clients are disconnected.
  void Stop() const { EXPECT_EQ(Run("pg_ctl", Control("stop -m fast")), 0) << Log(); }
  /// Shell commands that start and stop the server.
  std::string StartCommand() const { return AsOwner("pg_ctl", Control("start")); }
  std::string StopCommand() const { return AsOwner("pg_ctl", Control("stop -m fast")); }

 private:
  PrivatePostgres() {
    programs_ = OutputOf("ls -d /usr/lib/postgresql/*/bin 2>/dev/null | sort -V | tail -n 1");
    if (programs_.empty()) programs_ = OutputOf("dirname \"$(command -v initdb)\" 2>/dev/null");
    if (!std::filesystem::exists(Program("initdb"))) return;
    std::string folder = ::testing::TempDir() + "truetriad_postgres_XXXXXX";
    folder_ = ::mkdtemp(folder.data());
    if (is_root_) std::system(("chown postgres '" + folder_ + "'").c_str());
    // Ends the server when this end of the pipe is closed: by the destructor, or by the system.
    keeper_ = ::popen(("cat >/dev/null; " + AsOwner("pg_ctl", Control("stop -m immediate")) +
                       "; rm -rf '" + folder_ + "'")
                          .c_str(),
                      "we");
    EXPECT_EQ(Run("initdb", "-A trust -U postgres -E UTF8 --no-sync -D '" + folder_ + "/data'"), 0);
    Start();
    EXPECT_EQ(Run("createuser", "-h '" + folder_ + "' -U postgres line"), 0);
  }
  ~PrivatePostgres() {
    if (keeper_ != nullptr) ::pclose(keeper_);
  }

  std::string Program(const std::string& name) const { return programs_ + "/" + name; }
  std::string Control(const std::string& verb) const {
    return "-w -t " + std::to_string(kPatience.count()) + " -D '" + folder_ + "/data' -l '" +
           folder_ + "/log' -o \"-k '" + folder_ + "' -c listen_addresses='' -c fsync=off\" " +
           verb;
  }
  /// The server does not run as root.
  std::string AsOwner(const std::string& program, const std::string& arguments) const {
    return (is_root_ ? "cd / && runuser -u postgres -- '" : "'") + Program(program) + "' " +
           arguments + " >/dev/null 2>&1";
  }
  int Run(const std::string& program, const std::string& arguments) const {
    return std::system(AsOwner(program, arguments).c_str());
  }
  std::string Log() const { return OutputOf("cat '" + folder_ + "/log'"); }

  static std::string OutputOf(const std::string& command) {
    std::string text;
    if (std::FILE* const output = ::popen(command.c_str(), "r")) {
      std::array<char, 4096> part{};
      while (const std::size_t count = std::fread(part.data(), 1, part.size(), output)) {
        text.append(part.data(), count);
      }
      ::pclose(output);
    }
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
  }

  const bool is_root_ = ::geteuid() == 0;
  std::string programs_, folder_;
  std::FILE* keeper_ = nullptr;
  int databases_ = 0;
};

/// Skips the test if PostgreSQL is not installed.
#define TRUETRIAD_SKIP_WITHOUT_POSTGRES()                                \
  if (::truetriad::PrivatePostgres::Get() == nullptr) {                  \
    GTEST_SKIP() << "PostgreSQL's server is not installed (postgresql)"; \
  }                                                                      \
  static_assert(true)

}  // namespace truetriad
