#pragma once

namespace dexcheck {

/// This program's version, as in "0.1.0".
const char* Version();

}  // namespace dexcheck
