#pragma once

// The effect of every number of the engine's model: no field of an MJCF may change a force unseen.

#include <sstream>
#include <string>
#include <vector>

namespace dexcheck::testing {

enum class FieldClass {
  kDerived,     ///< The engine's compiler makes it of other fields; no MJCF can set it by itself.
  kCompared,    ///< With the analytic model: by a constant or a term of `consistency`.
  kReported,    ///< The analytic model has nothing like it: anything but the neutral value is a finding.
  kOverridden,  ///< The plant sets it (scenario), whatever the MJCF says; a note says so where it differs.
  kJudged,  ///< Concerns the plant alone, contacts and solver: a note names it, and the checks of a run judge
            ///< it.
  kNoEffect,  ///< Does not change motion and forces, as long as nothing is reported.
};

/// A field of mjModel ("body_mass"), mjOption ("opt.timestep") or mjStatistic ("stat.extent").
struct EngineField {
  std::string name;
  FieldClass outcome;
  /// kCompared, kReported: the check that names it; kOverridden: by what; kJudged: the note that names it;
  /// otherwise why.
  std::string how;
};

/// Fields of one class for one reason, their names in one text.
struct FieldGroup {
  FieldClass outcome;
  const char* how;
  const char* names;
};

constexpr FieldGroup kFieldGroups[] = {
    {FieldClass::kDerived, "size or address in the model's arrays",
     "nq nv nu na nbody njnt ngeom nsite ncam nlight nmesh nmeshvert nmeshtexvert nmeshface nmeshgraph nskin "
     "nskinvert nskintexvert nskinface nskinbone nskinbonevert nhfield nhfielddata ntex ntexdata nmat npair "
     "nexclude neq ntendon nwrap nsensor nnumeric nnumericdata ntext ntextdata ntuple ntupledata nkey nmocap "
     "nuser_body nuser_jnt nuser_geom nuser_site nuser_cam nuser_tendon nuser_actuator nuser_sensor nnames "
     "nM nD nemax nuserdata nsensordata nbuffer mesh_vertadr mesh_vertnum mesh_texcoordadr mesh_faceadr "
     "mesh_facenum mesh_graphadr skin_vertadr skin_vertnum skin_texcoordadr skin_faceadr skin_facenum "
     "skin_boneadr skin_bonenum skin_face skin_bonevertadr skin_bonevertnum skin_bonebodyid skin_bonevertid "
     "hfield_nrow hfield_ncol hfield_adr tex_type tex_height tex_width tex_adr tendon_adr tendon_num "
     "wrap_type wrap_objid sensor_type sensor_datatype sensor_needstage sensor_objtype sensor_objid "
     "sensor_reftype sensor_refid sensor_dim sensor_adr numeric_adr numeric_size text_adr text_size "
     "tuple_adr tuple_size tuple_objtype tuple_objid"},
    {FieldClass::kDerived, "size of buffers; a run that needs more ends with the engine's warning",
     "njmax nconmax nstack"},
    {FieldClass::kDerived, "order of the tree, which names match (adapter)",
     "body_parentid body_rootid body_weldid body_mocapid body_jntnum body_jntadr body_dofnum body_dofadr "
     "body_geomnum body_geomadr body_simple body_sameframe jnt_type jnt_qposadr jnt_dofadr jnt_bodyid "
     "dof_bodyid dof_jntid dof_parentid dof_Madr dof_simplenum geom_bodyid geom_sameframe site_bodyid "
     "site_sameframe"},
    {FieldClass::kDerived, "of the bodies' masses and inertias",
     "body_subtreemass body_invweight0 dof_invweight0 dof_M0 stat.meanmass stat.meansize"},
    {FieldClass::kDerived, "type or mesh that a geom refers to", "geom_type geom_dataid"},
    {FieldClass::kDerived, "bounding sphere of the geom", "geom_rbound"},
    {FieldClass::kDerived, "places of cameras and lights at the reference pose",
     "cam_poscom0 cam_pos0 cam_mat0 light_poscom0 light_pos0 light_dir0"},
    {FieldClass::kDerived, "order of a mesh's triangles and hull", "mesh_face mesh_graph"},
    {FieldClass::kDerived, "the geoms that a pair is named by", "pair_geom1 pair_geom2 pair_signature"},
    {FieldClass::kDerived, "what an equality constraint ties", "eq_type eq_obj1id eq_obj2id"},
    {FieldClass::kDerived, "of the tendons' paths", "tendon_length0 tendon_invweight0"},
    {FieldClass::kDerived, "the joint that a motor is named by", "actuator_trnid"},
    {FieldClass::kDerived, "of the motors' gears", "actuator_acc0 actuator_length0"},
    {FieldClass::kDerived, "names, by which both sides are matched (adapter)",
     "name_bodyadr name_jntadr name_geomadr name_siteadr name_camadr name_lightadr name_meshadr name_skinadr "
     "name_hfieldadr name_texadr name_matadr name_pairadr name_excludeadr name_eqadr name_tendonadr "
     "name_actuatoradr name_sensoradr name_numericadr name_textadr name_tupleadr name_keyadr names"},
    {FieldClass::kCompared, "joint_axis", "qpos0 body_pos body_quat jnt_pos jnt_axis"},
    {FieldClass::kCompared, "link_com", "body_ipos"},
    {FieldClass::kCompared, "link_inertia", "body_iquat body_inertia"},
    {FieldClass::kCompared, "link_mass", "body_mass"},
    {FieldClass::kCompared, "joint_range", "jnt_range"},
    {FieldClass::kCompared, "joint_armature", "dof_armature"},
    {FieldClass::kCompared, "joint_damping", "dof_damping"},
    {FieldClass::kCompared, "fingertip_radius", "geom_size"},
    {FieldClass::kCompared, "object_shape", "geom_user"},
    {FieldClass::kCompared, "frame_pose", "site_pos site_quat"},
    {FieldClass::kCompared, "contact_friction", "pair_friction"},
    {FieldClass::kCompared, "gravity_vector", "opt.gravity"},
    {FieldClass::kReported, "joint_limited", "jnt_limited"},
    {FieldClass::kReported, "joint_spring", "jnt_stiffness"},
    {FieldClass::kReported, "joint_limit_margin", "jnt_margin"},
    {FieldClass::kReported, "joint_dry_friction", "dof_frictionloss"},
    {FieldClass::kReported, "wheel_geom_place", "geom_pos"},
    {FieldClass::kReported, "floor_pose", "geom_quat"},
    {FieldClass::kReported, "contact_dimension", "pair_dim"},
    {FieldClass::kReported, "contact_margin", "pair_margin pair_gap"},
    {FieldClass::kReported, "equality_constraint", "eq_active"},
    {FieldClass::kReported, "tendon_limit", "tendon_limited"},
    {FieldClass::kReported, "tendon_spring", "tendon_stiffness"},
    {FieldClass::kReported, "tendon_damping", "tendon_damping"},
    {FieldClass::kReported, "tendon_friction", "tendon_frictionloss"},
    {FieldClass::kReported, "motor_transmission", "actuator_trntype actuator_gear"},
    {FieldClass::kReported, "motor_dynamics", "actuator_dyntype"},
    {FieldClass::kReported, "motor_gain", "actuator_gaintype actuator_gainprm"},
    {FieldClass::kReported, "motor_bias", "actuator_biastype"},
    {FieldClass::kReported, "fluid", "opt.density opt.viscosity"},
    {FieldClass::kReported, "disable_flag", "opt.disableflags"},
    {FieldClass::kReported, "enable_flag", "opt.enableflags"},
    {FieldClass::kOverridden, "plant.contact_time_constant", "pair_solref"},
    {FieldClass::kOverridden, "plant.contact_impedance", "pair_solimp"},
    {FieldClass::kOverridden, "plant.time_step", "opt.timestep"},
    {FieldClass::kOverridden, "plant.impratio", "opt.impratio"},
    {FieldClass::kOverridden, "plant.noslip_iterations", "opt.noslip_iterations"},
    {FieldClass::kJudged, "contacts_by_type",
     "geom_contype geom_conaffinity geom_condim geom_priority geom_solmix geom_solref geom_solimp "
     "geom_friction geom_margin geom_gap exclude_signature opt.collision"},
    {FieldClass::kJudged, "mesh_contacts", "mesh_vert hfield_size hfield_data"},
    {FieldClass::kJudged, "motor_limit",
     "actuator_ctrllimited actuator_forcelimited actuator_ctrlrange actuator_forcerange"},
    {FieldClass::kJudged, "solver",
     "opt.tolerance opt.noslip_tolerance opt.mpr_tolerance opt.integrator opt.cone opt.jacobian opt.solver "
     "opt.iterations opt.mpr_iterations stat.meaninertia"},
    {FieldClass::kNoEffect, "used by springs alone (joint_spring)", "qpos_spring"},
    {FieldClass::kNoEffect, "for users' programs",
     "body_user jnt_user site_user cam_user tendon_user actuator_user sensor_user numeric_data text_data "
     "tuple_objprm"},
    {FieldClass::kNoEffect, "looks",
     "jnt_group geom_matid geom_group geom_rgba site_type site_matid site_group site_size site_rgba cam_mode "
     "cam_bodyid cam_targetbodyid cam_pos cam_quat cam_fovy cam_ipd light_mode light_bodyid "
     "light_targetbodyid light_directional light_castshadow light_active light_pos light_dir "
     "light_attenuation light_cutoff light_exponent light_ambient light_diffuse light_specular mesh_normal "
     "mesh_texcoord skin_matid skin_group skin_rgba skin_inflate skin_vert skin_texcoord skin_bonebindpos "
     "skin_bonebindquat skin_bonevertweight tex_rgb mat_texid mat_texuniform mat_texrepeat mat_emission "
     "mat_specular mat_shininess mat_reflectance mat_rgba tendon_matid tendon_group tendon_width tendon_rgba "
     "actuator_group stat.center stat.extent"},
    {FieldClass::kNoEffect, "acts beyond the joints' ranges alone, where no run may go",
     "jnt_solref jnt_solimp"},
    {FieldClass::kNoEffect, "of dry friction (joint_dry_friction)", "dof_solref dof_solimp"},
    {FieldClass::kNoEffect, "of a fluid (fluid)", "geom_fluid opt.wind"},
    {FieldClass::kNoEffect, "of a constraint that is off (equality_constraint)",
     "eq_solref eq_solimp eq_data"},
    {FieldClass::kNoEffect, "of a tendon's limit (tendon_limit)",
     "tendon_solref_lim tendon_solimp_lim tendon_range tendon_margin"},
    {FieldClass::kNoEffect, "of a tendon's dry friction (tendon_friction)",
     "tendon_solref_fri tendon_solimp_fri"},
    {FieldClass::kNoEffect, "of a tendon's spring (tendon_spring)", "tendon_lengthspring"},
    {FieldClass::kNoEffect,
     "of a tendon without force (tendon_spring, tendon_damping, tendon_friction, tendon_limit, "
     "motor_transmission)",
     "wrap_prm"},
    {FieldClass::kNoEffect, "of a motor's dynamics (motor_dynamics)",
     "actuator_actlimited actuator_dynprm actuator_actrange"},
    {FieldClass::kNoEffect, "of a motor's bias (motor_bias)", "actuator_biasprm"},
    {FieldClass::kNoEffect, "of another transmission (motor_transmission)", "actuator_cranklength"},
    {FieldClass::kNoEffect, "of muscles (motor_gain, motor_bias)", "actuator_lengthrange"},
    {FieldClass::kNoEffect, "sensors measure and change nothing", "sensor_cutoff sensor_noise opt.magnetic"},
    {FieldClass::kNoEffect, "no run starts from a keyframe",
     "key_time key_qpos key_qvel key_act key_mpos key_mquat key_ctrl"},
    {FieldClass::kNoEffect, "used by viewers", "opt.apirate"},
    {FieldClass::kNoEffect, "of overridden contacts (enable_flag)", "opt.o_margin opt.o_solref opt.o_solimp"},
};

/// One entry for each field of the engine's version that this program is built for.
inline std::vector<EngineField> ListEngineFields() {
  std::vector<EngineField> fields;
  for (const FieldGroup& group : kFieldGroups) {
    std::istringstream names(group.names);
    for (std::string name; names >> name;) fields.push_back({name, group.outcome, group.how});
  }
  return fields;
}

}  // namespace dexcheck::testing
