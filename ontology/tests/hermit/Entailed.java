import java.io.BufferedReader;
import java.io.File;
import java.io.InputStreamReader;
import org.semanticweb.HermiT.Configuration;
import org.semanticweb.HermiT.Reasoner;
import org.semanticweb.owlapi.apibinding.OWLManager;
import org.semanticweb.owlapi.model.IRI;
import org.semanticweb.owlapi.model.OWLAxiom;
import org.semanticweb.owlapi.model.OWLOntology;

/**
 * Reads lines "premise TAB conclusion" and prints a line for each: "inconsistent", "error REASON", or the number of the
 * conclusion's logical axioms that HermiT entails and the axioms that it does not, separated by tabs.
 */
public class Entailed {
    private static OWLOntology load(String file) throws Exception {
        return OWLManager.createOWLOntologyManager().loadOntologyFromOntologyDocument(IRI.create(new File(file)));
    }

    private static volatile Reasoner reasoner;

    private static String judge(String premise, String conclusion) {
        try {
            Configuration configuration = new Configuration();
            configuration.individualTaskTimeout = 5_000;
            configuration.ignoreUnsupportedDatatypes = true;
            reasoner = new Reasoner(configuration, load(premise));
            if (!reasoner.isConsistent()) {
                return "inconsistent";
            }
            int entailed = 0;
            StringBuilder missing = new StringBuilder();
            for (OWLAxiom axiom : load(conclusion).getLogicalAxioms()) {
                if (reasoner.isEntailed(axiom)) {
                    entailed++;
                } else {
                    missing.append('\t').append(axiom.toString().replace('\n', ' ').replace('\t', ' '));
                }
            }
            return entailed + missing.toString();
        } catch (Throwable error) {
            return "error " + error.getClass().getSimpleName() + " " + String.valueOf(error.getMessage()).replaceAll("\\s+", " ");
        }
    }

    public static void main(String[] args) throws Exception {
        BufferedReader lines = new BufferedReader(new InputStreamReader(System.in));
        for (String line = lines.readLine(); line != null; line = lines.readLine()) {
            String[] files = line.split("\t");
            String[] answer = {"error timeout"};
            Thread judge = new Thread(() -> answer[0] = judge(files[0], files[1]));
            judge.setDaemon(true);
            judge.start();
            judge.join(20_000);
            if (judge.isAlive()) {
                reasoner.interrupt();
                judge.join(5_000);
                System.out.println("error timeout");
            } else {
                System.out.println(answer[0]);
            }
            System.out.flush();
        }
        System.exit(0);
    }
}
