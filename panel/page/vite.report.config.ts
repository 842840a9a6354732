import { defineConfig } from "vite";

// One script and one sheet of styles, which 'trunnion run --report' puts into a page that works from a file.
export default defineConfig({
  esbuild: { jsx: "automatic", jsxImportSource: "preact" },
  define: { "process.env.NODE_ENV": '"production"' },
  build: {
    target: "es2021",
    emptyOutDir: false,
    copyPublicDir: false,
    lib: { entry: "src/report.tsx", formats: ["iife"], name: "report", fileName: () => "report.js" },
    rollupOptions: { output: { assetFileNames: "report.[ext]" } },
  },
});
