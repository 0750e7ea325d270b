#pragma once

// A copy of a model's file in which what a recording says of the robot is put right.

#include <filesystem>
#include <string>
#include <vector>

#include "harness/descriptions/read_description.h"
#include "harness/recordings/judge_recordings.h"

namespace dexcheck {

struct CorrectedFile {
  std::string text;
  std::vector<std::string> written;  ///< "joint elbow: dry friction 0.3".
  std::vector<std::string>
      left;  ///< Causes that are none of the model's, or that the format has no place for.
};

/// Friction, armature, bodies and gravity, as found, in the file's own numbers; comments stay.
/// @param folder in which the text will stand: an MJCF finds its meshes from there.
/// @throws InputError "FILE: ..." where a number stands in no place of its own, as in a template.
CorrectedFile WriteCorrections(const DescriptionFile& source, const RecordingJudgement& judgement,
                               const std::filesystem::path& folder);

}  // namespace dexcheck
