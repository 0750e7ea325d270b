#pragma once

// Paths of the project's files and of the build's products, for the tests. Only paths.cc has folders of this
// machine, so that a compiled test serves every clone.

#include <string>

namespace dexcheck::testing {

/// A file of the project's sources: SourcePath("/mjcf/scene.xml").
std::string SourcePath(const std::string& name = "");

/// The folder of this build, and the program dexcheck in it.
std::string BuildPath(const std::string& name = "");
std::string ProgramPath();

}  // namespace dexcheck::testing
