// Which of the kernel libraries this processor can run.

extern "C" __attribute__((visibility("default"))) const char* pathwalker_cpu_level() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("x86-64-v4")) return "x86-64-v4";
  if (__builtin_cpu_supports("x86-64-v3")) return "x86-64-v3";
#endif
  return "generic";
}
