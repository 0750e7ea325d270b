// Preloaded into the program, stands for a MuJoCo library of another version.

extern "C" int mj_version() { return 231; }
