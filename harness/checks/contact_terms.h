#pragma once

#include "controller/contact/grasp_map.h"
#include "harness/checks/term_table.h"
#include "harness/descriptions/engine_provider.h"

namespace dexcheck {

/// Evaluates the contact of one of the compared frames by the engine: its narrow phase and the motion of the
/// two bodies that touch, and what of the model's values follows from the contact alone.
/// @param contact by the model. @param shift carries the projected robot to where the plant has it.
void EvaluateContact(const Contact& contact, const Pose& shift, size_t index, EngineProvider* engine,
                     ContactValues* model, ScaleContext* scales);

}  // namespace dexcheck
